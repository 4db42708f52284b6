// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/NarrowPhaseCollision/btManifoldPoint.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// What btManifoldResult::addContactPoint() gives every point of two bodies: friction and restitution. Calls the
/// application's functions for them.
inline void setMaterial(const btCollisionObject& a, const btCollisionObject& b, btManifoldPoint& point)
{
    point.m_combinedFriction = gCalculateCombinedFrictionCallback(&a, &b);
    point.m_combinedRestitution = gCalculateCombinedRestitutionCallback(&a, &b);
    point.m_combinedRollingFriction = gCalculateCombinedRollingFrictionCallback(&a, &b);
    point.m_combinedSpinningFriction = gCalculateCombinedSpinningFrictionCallback(&a, &b);
}

/// What btManifoldResult::addContactPoint() derives from the normal of a point.
inline void setNormal(const btVector3& normal, btManifoldPoint& point)
{
    point.m_normalWorldOnB = normal;
    btPlaneSpace1(normal, point.m_lateralFrictionDir1, point.m_lateralFrictionDir2);
}

/// btPersistentManifold::replaceContactPoint() by a point of the same triangles, with its normal and material: impulses,
/// lifetime, places and the application's data stay.
[[gnu::always_inline]] inline void renewPoint(const btManifoldPoint& by, btManifoldPoint& point)
{
    point.m_normalWorldOnB = by.m_normalWorldOnB;
    point.m_lateralFrictionDir1 = by.m_lateralFrictionDir1;
    point.m_lateralFrictionDir2 = by.m_lateralFrictionDir2;
    point.m_combinedFriction = by.m_combinedFriction;
    point.m_combinedRollingFriction = by.m_combinedRollingFriction;
    point.m_combinedSpinningFriction = by.m_combinedSpinningFriction;
    point.m_combinedRestitution = by.m_combinedRestitution;
    point.m_contactPointFlags = 0;
    point.m_contactMotion1 = point.m_contactMotion2 = 0;
    point.m_contactCFM = point.m_contactERP = point.m_frictionCFM = 0;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
