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
}  // namespace CULLET_PRECISION
}  // namespace cullet
