// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/convex/kept_contacts.h"

#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btTriangleCallback.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A hash of triangles in their order: corners, parts and indices, bit by bit. With 64 bits it is not equal for other
/// triangles by chance.
class TriangleHash final : public btTriangleCallback
{
public:
    void add(const btVector3* corners, int part, int index) noexcept;
    void processTriangle(btVector3* corners, int part, int index) override { add(corners, part, index); }

    std::uint64_t value() const noexcept { return m_value; }

private:
    std::uint64_t m_value = 0;
};

/// A prepared mesh, whose triangles its application has declared constant, with its current scale.
struct ConstantTriangles
{
    std::uint64_t serial = 0;  ///< see MeshQueries; 0: the mesh is not prepared
    btVector3 scale = btVector3(1, 1, 1);

    static ConstantTriangles of(const btConcaveShape& mesh);
    bool operator==(const ConstantTriangles& other) const noexcept;
};

/// The contacts that a pair of a convex shape and a mesh keeps (IsaGjkOptions::reusePose), and the triangles in the box in
/// which they were computed. In each call the mesh reports the triangles of that box again, unless it is prepared: any
/// edit that could change the contacts shows.
class KeptMeshContacts
{
public:
    /// Whether contacts may be kept, but for the triangles.
    bool holdFor(const ContactCall& call) const noexcept { return m_contacts.holdFor(call); }
    /// Whether the mesh has the same triangles as when the contacts were computed; false if they were not hashed.
    bool haveTrianglesOf(const btConcaveShape& mesh) const;
    void renew(const ContactCall& call) const { m_contacts.renew(call); }

    bool isStored() const noexcept { return m_contacts.isStored(); }
    void forget() noexcept { m_contacts.forget(); }
    void store(const ContactCall& call) noexcept { m_contacts.store(call); }
    /// The triangles of the stored contacts.
    ///
    /// @param hash null for a body that moves, which does without, and for a prepared mesh
    void setTriangles(const btConcaveShape& mesh, const btVector3& low, const btVector3& high,
                      const TriangleHash* hash) noexcept;

private:
    KeptContacts m_contacts;
    ConstantTriangles m_constant;
    btVector3 m_low, m_high;  ///< in the mesh's frame
    std::uint64_t m_hash = 0;
    bool m_hasTriangles = false;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
