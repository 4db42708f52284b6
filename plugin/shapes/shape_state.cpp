// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/shapes/shape_state.h"

#include "cullet/plugin/shapes/convex_shape.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
btScalar largestOf(const btVector3& v)
{
    return std::max({std::abs(v.x()), std::abs(v.y()), std::abs(v.z())});
}

bool areEqual(const btVector3& a, const btVector3& b)
{
    return a.x() == b.x() && a.y() == b.y() && a.z() == b.z();
}
}  // namespace

bool ShapeState::read(const btCollisionShape& shape, HullUse& hull, std::uint64_t pass) noexcept
{
    m_shape = &shape;
    m_type = shape.getShapeType();
    if (!shape.isConcave())
        return shape.isConvex() && readConvex(shape, hull, pass);
    m_margin = shape.getMargin();
    m_radius = std::numeric_limits<btScalar>::infinity();
    return true;
}

bool ShapeState::readConvex(const btCollisionShape& shape, HullUse& hull, std::uint64_t pass) noexcept
{
    const ConvexKind kind = convexKindOf(m_type);
    if (!isPolytope(kind) || kind == ConvexKind::Triangle)
        return false;
    const auto& convex = static_cast<const btConvexInternalShape&>(shape);
    m_margin = convex.getMarginNV();
    m_size = convex.getImplicitShapeDimensions();
    switch (kind)
    {
        case ConvexKind::Hull:
        {
            const auto& points = static_cast<const btConvexHullShape&>(shape);
            const Hull<btScalar>* const contents = hull.hullOf(points, pass);
            m_features = points.getConvexPolyhedron();
            m_size = points.getLocalScalingNV();
            if (contents == nullptr)
                return false;
            m_revision = hull.revision();
            m_radius = largestOf(m_size) * static_cast<btScalar>(contents->radius()) + m_margin;
            return true;
        }
        case ConvexKind::Box:
            m_features = static_cast<const btBoxShape&>(shape).getConvexPolyhedron();
            m_radius = m_size.length() + 2 * m_margin;
            return true;
        case ConvexKind::Capsule:
            m_axis = static_cast<const btCapsuleShape&>(shape).getUpAxis();
            m_radius = std::abs(m_size[m_axis]) + std::abs(m_margin);
            return true;
        default:
            m_size = m_size * convex.getLocalScalingNV();
            m_radius = std::abs(m_size.x());
            return true;
    }
}

bool ShapeState::operator==(const ShapeState& other) const noexcept
{
    return m_shape == other.m_shape && m_type == other.m_type && m_revision == other.m_revision &&
           m_features == other.m_features && m_axis == other.m_axis && m_margin == other.m_margin &&
           areEqual(m_size, other.m_size);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
