// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/posed_hull.h"
#include "cullet/narrow/math/lanes.h"
#include "cullet/plugin/shapes/hull_cache.h"
#include "cullet/plugin/shapes/separating_axis.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btConvexShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>

#include <optional>

namespace cullet
{
inline namespace CULLET_PRECISION
{
using PosedShape = PosedHull<btScalar>;

inline Eigen::Matrix<btScalar, 3, 1> toEigen(const btVector3& v)
{
    return {v.x(), v.y(), v.z()};
}

inline btVector3 toBullet(const Eigen::Vector3d& v)
{
    return btVector3(static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()),
                     static_cast<btScalar>(v.z()));
}

/// How a convex shape of Bullet's is seen here: a core that is a polytope or a support function, grown by a margin.
enum class ConvexKind : std::uint8_t
{
    Hull,      ///< btConvexHullShape: its points, scaled
    Box,       ///< a cube, stretched; the core is smaller than the box by boxMargin()
    Triangle,  ///< three points
    Capsule,   ///< a segment; the margin is the radius
    Sphere,    ///< a point; the margin is the radius
    Support,   ///< Bullet's support function without margin
    Foreign    ///< two-dimensional, not convex, or inside out: not for this library
};

inline ConvexKind convexKindOf(int shapeType)
{
    // First what is asked for most.
    if (shapeType == CONVEX_HULL_SHAPE_PROXYTYPE)
        return ConvexKind::Hull;
    switch (shapeType)
    {
        case BOX_SHAPE_PROXYTYPE:
            return ConvexKind::Box;
        case TRIANGLE_SHAPE_PROXYTYPE:
            return ConvexKind::Triangle;
        case CAPSULE_SHAPE_PROXYTYPE:
            return ConvexKind::Capsule;
        case SPHERE_SHAPE_PROXYTYPE:
            return ConvexKind::Sphere;
        case BOX_2D_SHAPE_PROXYTYPE:
        case CONVEX_2D_SHAPE_PROXYTYPE:
            return ConvexKind::Foreign;
        default:
            return btBroadphaseProxy::isConvex(shapeType) ? ConvexKind::Support : ConvexKind::Foreign;
    }
}

inline bool isPolytope(ConvexKind kind)
{
    return kind < ConvexKind::Support;
}

/// Of a box or a cylinder: true where scaling or setMargin() has left a margin that is larger than a half extent. What
/// Bullet has for the half extents without it is then negative, and no core.
inline bool isThinnerThanMargin(const btConvexInternalShape& shape)
{
    Components halfExtents;
    read(shape.getImplicitShapeDimensions(), halfExtents);
    return (quadBits<btScalar>(halfExtents < Components{}) & 7u) != 0;
}

/// The kind of a shape as it is.
///
/// Foreign too: a cylinder that is thinner than its margin, which Bullet's support function turns inside out, so that it
/// proves no gap; and a capsule that was scaled by less than nothing, whose radius is negative.
inline ConvexKind convexKindOf(const btConvexShape& shape)
{
    const int type = shape.getShapeType();
    const ConvexKind kind = convexKindOf(type);
    if (kind != ConvexKind::Capsule && type != CYLINDER_SHAPE_PROXYTYPE)
        return kind;
    const auto& internal = static_cast<const btConvexInternalShape&>(shape);
    const bool isInsideOut =
        kind == ConvexKind::Capsule ? internal.getMarginNV() < 0 : isThinnerThanMargin(internal);
    return isInsideOut ? ConvexKind::Foreign : kind;
}

/// What a box is made of here: a cuboid, grown by a margin.
struct BoxCore
{
    btVector3 halfExtents;
    btScalar margin;
};

/// For a box that is thinner than its margin.
///
/// The margin is a tenth of the least half extent, which Bullet itself chooses for a box that is made so small: the faces
/// stay where they are, and the core keeps faces to rest on.
BoxCore thinBoxCore(const btBoxShape& box);

/// As far as the faces of a box are from those of its core: the box's margin, unless it is thinner than that.
inline btScalar boxMargin(const btBoxShape& box)
{
    return isThinnerThanMargin(box) ? thinBoxCore(box).margin : box.getMarginNV();
}

inline bool hasFiniteCorners(const btTriangleShape& triangle)
{
    Components sum = {};
    for (const btVector3& corner : triangle.m_vertices1)
    {
        Components point;
        read(corner, point);
        // Nothing, but NaN of what is not finite; the fourth means nothing.
        sum += point - point;
    }
    return (quadBits<btScalar>(sum == Components{}) & 7u) == 7u;
}

/// True if the support function is Bullet's own, which reads the shape and nothing else; a custom shape's may do anything.
bool canRunConcurrently(int shapeType);

/// The core of a polytope kind at its place. Nothing is copied but the transform.
///
/// @param use  remembers the graph of a Hull between calls
/// @param pass see HullCache::hullOf
/// @return nothing if the shape has no points, they are not finite, or memory ran out
std::optional<PosedShape> poseShape(const btConvexShape& shape, ConvexKind kind, const btTransform& transform,
                                    HullUse& use, std::uint64_t pass);

/// The way from a point of the world to the origin() of a core, without a rounding that is larger than those of the way.
Eigen::Vector3d wayToOrigin(const Eigen::Vector3d& from, const btConvexShape& shape, ConvexKind kind,
                            const btTransform& transform);

/// A hull shape, scaled as it is, of which the graph is known.
PosedShape poseHull(const Hull<btScalar>& hull, const btConvexShape& hullShape, const btTransform& transform);

/// A box or sphere for staysSeparated().
///
/// @return false for other kinds, and for a box that is thinner than its margin, whose core is nowhere in memory
bool stretchUnitHull(const btConvexShape& shape, const btTransform& transform, StretchedHull& stretched);

/// A hull, box or sphere without a copy of its transform, for staysSeparated().
///
/// @return false where stretchUnitHull() or poseShape() gives nothing
[[gnu::always_inline]] inline bool stretchShape(const btConvexShape& shape, const btTransform& transform,
                                                HullUse& use, std::uint64_t pass, StretchedHull& stretched)
{
    if (shape.getShapeType() != CONVEX_HULL_SHAPE_PROXYTYPE)
    {
        // A copy: what is written to through a reference stays in memory.
        StretchedHull unit = {};
        const bool isKnown = stretchUnitHull(shape, transform, unit);
        stretched = unit;
        return isKnown;
    }
    const auto& hull = static_cast<const btConvexHullShape&>(shape);
    stretched = {use.hullOf(hull, pass), &hull.getLocalScalingNV(), &transform};
    return stretched.hull != nullptr && stretched.hull->vertexCount() > 0;
}

/// A shape of kind Support for the queries of narrow/.
class PosedSupport
{
public:
    /// @param anchor point of the world to which the origin is relative
    PosedSupport(const btConvexShape& shape, const btTransform& transform, const Eigen::Vector3d& anchor)
        : m_shape(&shape),
          m_transform(&transform),
          m_origin(toEigen(transform.getOrigin()).cast<double>() - anchor)
    {
    }

    const Eigen::Vector3d& origin() const { return m_origin; }
    Eigen::Vector3d centre() const { return Eigen::Vector3d::Zero(); }
    std::int32_t vertexCount() const { return 0; }
    Eigen::Vector3d point(std::int32_t) const { return Eigen::Vector3d::Zero(); }

    SupportPoint support(const Eigen::Vector3d& direction, std::int32_t) const
    {
        const btMatrix3x3& basis = m_transform->getBasis();
        const btVector3 point = m_shape->localGetSupportVertexWithoutMarginNonVirtual(toLocal(direction));
        Eigen::Vector3d world;
        for (int row = 0; row < 3; ++row)
        {
            const btVector3& r = basis[row];
            world[row] = double(r.x()) * double(point.x()) + double(r.y()) * double(point.y()) +
                         double(r.z()) * double(point.z());
        }
        return {world, -1};
    }

private:
    /// In four lanes that all have a value: compilers that take two at a time may compute with what is left beside them, and
    /// raise the flag of an invalid operation.
    btVector3 toLocal(const Eigen::Vector3d& direction) const
    {
        const double largest = direction.cwiseAbs().maxCoeff();
        const Eigen::Vector3d scaled = direction / (largest > 0.0 ? largest : 1.0);
        Components rows[3];
        for (int i = 0; i < 3; ++i)
        {
            read(m_transform->getBasis()[i], rows[i]);
            Quad<btScalar>::clearLast(rows[i]);
        }
        const Components local = rows[0] * static_cast<btScalar>(scaled[0]) +
                                 rows[1] * static_cast<btScalar>(scaled[1]) +
                                 rows[2] * static_cast<btScalar>(scaled[2]);
        return btVector3(local[0], local[1], local[2]);
    }

    const btConvexShape* m_shape;
    const btTransform* m_transform;
    Eigen::Vector3d m_origin;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
