// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Sets the fields of a callback as btCollisionWorld::rayTest() does.
inline void aimRay(btBroadphaseRayCallback& callback, const btVector3& from, const btVector3& to)
{
    btVector3 direction = to - from;
    callback.m_lambda_max = direction.length();
    direction /= callback.m_lambda_max;
    for (int axis = 0; axis < 3; ++axis)
    {
        callback.m_rayDirectionInverse[axis] =
            direction[axis] == btScalar(0) ? btScalar(BT_LARGE_FLOAT) : btScalar(1) / direction[axis];
        callback.m_signs[axis] = callback.m_rayDirectionInverse[axis] < btScalar(0) ? 1 : 0;
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
