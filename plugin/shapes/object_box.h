// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/shapes/shape_boxes.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Computes the boxes of a world's objects as btCollisionWorld::updateSingleAabb().
class ObjectBox
{
public:
    explicit ObjectBox(btCollisionWorld& world)
        : m_isContinuous(world.getDispatchInfo().m_useContinuous),
          m_threshold(gContactBreakingThreshold, gContactBreakingThreshold, gContactBreakingThreshold)
    {
    }

    /// @return false: Bullet's own function must run on the calling thread, since the shape has no thread-safe getAabb(), or
    ///         since the box is oversized, for which it deactivates the body and prints a warning
    [[gnu::always_inline]] inline bool compute(const btCollisionObject& object, ShapeBoxes& shapes,
                                               btVector3& min, btVector3& max) const
    {
        const btCollisionShape& shape = *object.getCollisionShape();
        if (!shapes.compute(shape, object.getWorldTransform(), min, max))
            return false;
        min -= m_threshold;
        max += m_threshold;
        if (m_isContinuous && object.getInternalType() == btCollisionObject::CO_RIGID_BODY &&
            !object.isStaticOrKinematicObject())
        {
            btVector3 predictedMin, predictedMax;
            shapes.compute(shape, object.getInterpolationWorldTransform(), predictedMin, predictedMax);
            min.setMin(predictedMin - m_threshold);
            max.setMax(predictedMax + m_threshold);
        }
        return object.isStaticObject() || (max - min).length2() < btScalar(1e12);
    }

private:
    bool m_isContinuous;
    btVector3 m_threshold;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
