// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Whether an object has the marks that Bullet gives in each step to one without an island.
inline bool isMarkedAsStatic(const btCollisionObject& object)
{
    return object.getIslandTag() == -1 && object.getCompanionId() == -2 &&
           object.getHitFraction() == btScalar(1);
}

/// Marks an object as one without an island. Nothing is written if it was one in the last step.
inline void markAsStatic(btCollisionObject& object)
{
    if (isMarkedAsStatic(object))
        return;
    object.setIslandTag(-1);
    object.setCompanionId(-2);
    object.setHitFraction(1);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
