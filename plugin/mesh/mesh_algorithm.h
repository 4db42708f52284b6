// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/isa_gjk.h"

#include <BulletCollision/CollisionDispatch/btConvexConcaveCollisionAlgorithm.h>

#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
struct MeshQuery;

/// The contacts of a hull, box or capsule with the triangles of a concave shape; replaces Bullet's loop over triangles.
///
/// Bullet makes an algorithm for each triangle in the body's box and asks it. Here most triangles are dropped before:
/// those outside of the box around the core in its own frame, and those beyond an axis that separates a neighbour. One
/// algorithm answers for the rest, in the order in which the shape names its triangles, and remembers where its last
/// search ended.
///
/// As with Bullet there is one manifold per pair from the constructor on, its first body is the convex one, and points
/// carry part and index of their triangle. The shape is asked for its triangles in every call through its virtual
/// function, so that edits of any kind are seen at once. What is remembered between calls are axes, which are verified
/// before they drop a triangle: contacts depend on shapes and poses alone.
///
/// Left to Bullet's loop: other convex shapes, queries outside of a step or with a distance threshold, an algorithm of
/// the application for triangles, bodies whose basis is no rotation, lack of memory.
class MeshAlgorithm final : public btConvexConcaveCollisionAlgorithm
{
public:
    /// @param isSwapped the second body is the convex one
    MeshAlgorithm(IsaGjkRegistration& isaGjk, const btCollisionAlgorithmConstructionInfo& info,
                  const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, bool isSwapped);
    ~MeshAlgorithm() override;

    void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                          const btDispatcherInfo& info, btManifoldResult* result) override;

private:
    bool canAsk(const btCollisionShape& convex, const btCollisionShape& mesh,
                const btManifoldResult& result) const;
    MeshQuery* query();

    bool m_isSwapped;
    IsaGjkRegistration& m_isaGjk;
    std::unique_ptr<MeshQuery> m_query;  ///< null until the first call with triangles
};

// Bullet's pool has elements of this size and ignores the requested size.
static_assert(sizeof(MeshAlgorithm) <= 192, "too large for the pool of Bullet's configuration");
}  // namespace CULLET_PRECISION
}  // namespace cullet
