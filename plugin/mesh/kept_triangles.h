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

/// The contacts that a pair of a convex shape and a mesh keeps (IsaGjkOptions::reusePose), and the triangles in the box in
/// which they were computed. In each call the mesh reports the triangles of that box again: any edit that could change
/// the contacts shows.
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
    /// The triangles of the stored contacts. Bodies that move do without the hash.
    void setTriangles(const btVector3& low, const btVector3& high, const TriangleHash& hash) noexcept;
    void forgetTriangles() noexcept { m_hasTriangles = false; }

private:
    KeptContacts m_contacts;
    btVector3 m_low, m_high;  ///< in the mesh's frame
    std::uint64_t m_hash = 0;
    bool m_hasTriangles = false;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
