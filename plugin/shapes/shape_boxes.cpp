// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/shapes/shape_boxes.h"

#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/shapes/thread_safe_aabb.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <LinearMath/btTransform.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Numbers in [-1, 1) without a pattern.
class Numbers
{
public:
    btScalar next()
    {
        m_state = m_state * 6364136223846793005u + 1442695040888963407u;
        return btScalar(std::int32_t(m_state >> 32)) * btScalar(4.656612873e-10);
    }
    btVector3 vector()
    {
        const btScalar x = next(), y = next(), z = next();
        return {x, y, z};
    }

private:
    std::uint64_t m_state = 1;
};

bool computesBulletsBoxes()
{
    Numbers numbers;
    for (int i = 0; i < 64; ++i)
    {
        const btBoxShape shape(numbers.vector().absolute() + btVector3(1, 1, 1));
        const btVector3 rows[] = {numbers.vector(), numbers.vector(), numbers.vector()};
        const btTransform transform(btMatrix3x3(rows[0], rows[1], rows[2]), numbers.vector());
        btVector3 min, max, expectedMin, expectedMax;
        btTransformAabb(shape.getHalfExtentsWithoutMargin(), shape.btConvexInternalShape::getMargin(),
                        transform, min, max);
        shape.getAabb(transform, expectedMin, expectedMax);
        if (!isSameBox(min, max, expectedMin, expectedMax))
            return false;
    }
    return true;
}
}  // namespace

bool hasBulletsBoxes()
{
    static const bool isSame = computesBulletsBoxes();
    return isSame;
}

void ShapeBoxes::know(const btCollisionShape& shape)
{
    m_shape = &shape;
    if (isExactly<btBoxShape>(shape) && hasBulletsBoxes())
    {
        const auto& box = static_cast<const btBoxShape&>(shape);
        m_kind = Kind::Box;
        m_halfExtents = box.getHalfExtentsWithoutMargin();
        m_margin = box.btConvexInternalShape::getMargin();
        return;
    }
    m_kind = hasThreadSafeAabb(shape) ? Kind::ThreadSafe : Kind::Foreign;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
