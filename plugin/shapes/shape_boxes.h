// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/box_convert.h"
#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <LinearMath/btAabbUtil2.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Computes the boxes of one shape after the other, with the bits of getAabb(). It remembers what it knows of the last
/// shape, since many bodies share one: to be used during a pass in which no shape changes.
class ShapeBoxes
{
public:
    /// @return false, with nothing computed: only the calling thread may call getAabb() of the shape (hasThreadSafeAabb())
    [[gnu::always_inline]] inline bool compute(const btCollisionShape& shape, const btTransform& transform,
                                               btVector3& min, btVector3& max)
    {
        if (&shape != m_shape)
            know(shape);
        if (m_kind == Kind::Foreign)
            return false;
        if (m_kind == Kind::Box)
            btTransformAabb(m_halfExtents, m_margin, transform, min, max);
        // Which NaN a sum of two is depends on the order of the operands, which the compiler chooses.
        if (m_kind == Kind::ThreadSafe || !isValidBox(min, max))
            shape.getAabb(transform, min, max);
        return true;
    }

private:
    enum class Kind : std::uint8_t
    {
        Foreign,
        Box,  ///< exactly a btBoxShape, whose box is computed here
        ThreadSafe
    };

    void know(const btCollisionShape& shape);

    const btCollisionShape* m_shape = nullptr;
    Kind m_kind = Kind::Foreign;
    btVector3 m_halfExtents;
    btScalar m_margin = 0;
};

/// Whether Bullet's library computes the box of a btBoxShape with the bits of btTransformAabb() as it is compiled here.
/// Compared for many boxes once per process: the library may have been compiled with fused multiply-adds.
bool hasBulletsBoxes();
}  // namespace CULLET_PRECISION
}  // namespace cullet
