// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/box/box_contact.h"
#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Updates the manifold of a step as btManifoldResult::addContactPoint(), called for each point, and then
/// refreshContactPoints() do, with the same bits; what the points of a pair have in common is computed once. In a full
/// manifold, a new point replaces an older one that the patch does not renew, and never one of the patch.
///
/// The application's functions for friction and restitution are called once per patch instead of once per point.
///
/// @param result of a step, with the manifold set
/// @return false if Bullet must add the points, for which there is room: for callbacks and flags of the application, and
///         for a manifold of other bodies
bool updateManifold(const BoxContact<btScalar>& contact, const btManifoldResult& result,
                    btPersistentManifold& manifold);

/// Adds points one by one as btManifoldResult::addContactPoint() does, with the same bits; what all points of a pair have in
/// common is computed once.
///
/// The application's functions for friction and restitution are called once for all points.
class PointUpdate
{
public:
    /// Whether no callback and no flag of the application concerns single points.
    ///
    /// @param result of a step, with a manifold of its bodies set
    static bool isPossible(const btManifoldResult& result);

    /// @pre isPossible(result)
    PointUpdate(const btManifoldResult& result, btPersistentManifold& manifold);

    /// Adds a point with the shape identifiers that the result has now.
    void add(const btVector3& normal, const btVector3& onB, btScalar distance);

private:
    const btManifoldResult& m_result;
    btPersistentManifold& m_manifold;
    const bool m_isSwapped;
    const btTransform &m_atA, &m_atB;  ///< of the manifold's bodies
    btManifoldPoint m_point;           ///< the last one
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
