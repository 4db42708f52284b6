// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/convex/isa_gjk_registration.h"

#include <BulletCollision/CollisionDispatch/btConvexConcaveCollisionAlgorithm.h>

#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
class MeshRegion;
class TrianglePass;
struct ContactCall;
struct MeshQuery;

/// The contacts of a convex shape with the triangles of a concave one; replaces Bullet's loop over triangles.
///
/// Bullet makes an algorithm for each triangle in the body's box and asks it. Here most triangles are dropped before:
/// those outside of the box around the core in its own frame, and those beyond an axis that separates a neighbour. Each
/// of the others is searched in the order in which the shape names them, from where the last search for it ended; and the
/// manifold gets the few points of all that carry the contact. Cylinders, cones and other shapes without corners touch
/// by Bullet's own algorithm, one point a triangle.
///
/// As with Bullet there is one manifold per pair from the constructor on, its first body is the convex one, and points
/// carry part and index of their triangle. The shape's triangles are read in every call, so that edits of any kind are
/// seen at once. What is remembered between calls are guesses: contacts depend on shapes and poses alone.
///
/// Left to Bullet's loop: convex shapes of the application and two-dimensional ones, queries outside of a step or with a
/// distance threshold, an algorithm of the application for triangles, bodies whose basis is no rotation, perturbation,
/// enableSatConvex, lack of memory.
class MeshAlgorithm final : public btConvexConcaveCollisionAlgorithm
{
public:
    /// @param isSwapped the second body is the convex one
    MeshAlgorithm(IsaGjkRegistration& isaGjk, const btCollisionAlgorithmConstructionInfo& info,
                  const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, bool isSwapped);
    ~MeshAlgorithm() override;

    void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                          const btDispatcherInfo& info, btManifoldResult* result) override;
    /// processCollision() for a child of a compound.
    ///
    /// @param region has the triangles near the child, if it covers them; it saves a search of the mesh
    void processNear(MeshRegion& region, const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                     const btDispatcherInfo& info, btManifoldResult& result);

private:
    void process(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                 const btDispatcherInfo& info, MeshRegion* region, btManifoldResult& result);
    bool canAsk(const btCollisionShape& body, const btCollisionShape& mesh, const btDispatcherInfo& info,
                const btManifoldResult& result) const;
    MeshQuery* query();
    bool keepContacts(MeshQuery& query, const ContactCall& call);
    void storeContacts(MeshQuery& query, const ContactCall& call, const TrianglePass& pass);
    void runBulletsLoop(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                        const btDispatcherInfo& info, btManifoldResult* result);

    bool m_isSwapped;
    IsaGjkRegistration& m_isaGjk;
    std::unique_ptr<MeshQuery> m_query;  ///< null until the first call with triangles
};

// Bullet's pool has elements of this size and ignores the requested size.
static_assert(sizeof(MeshAlgorithm) <= 192, "too large for the pool of Bullet's configuration");
}  // namespace CULLET_PRECISION
}  // namespace cullet
