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

/// The basis of a transform.
Eigen::Matrix<btScalar, 3, 3> basisOf(const btTransform& transform);

inline btVector3 toBullet(const Eigen::Vector3d& v)
{
    return btVector3(static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()),
                     static_cast<btScalar>(v.z()));
}

/// The kind of core of one of Bullet's convex shapes: a polytope or a support function, which the margin enlarges.
enum class ConvexKind : std::uint8_t
{
    Hull,        ///< btConvexHullShape: its points, scaled
    Box,         ///< a scaled cube; the core is smaller than the box by boxMargin()
    Triangle,    ///< three points
    Capsule,     ///< a segment; the margin is the radius
    Sphere,      ///< a point; the margin is the radius
    Support,     ///< Bullet's support function without margin
    Unsupported  ///< two-dimensional, not convex, or inside out: left to Bullet
};

inline ConvexKind convexKindOf(int shapeType)
{
    // The most frequent type first.
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
            return ConvexKind::Unsupported;
        default:
            return btBroadphaseProxy::isConvex(shapeType) ? ConvexKind::Support : ConvexKind::Unsupported;
    }
}

inline bool isPolytope(ConvexKind kind)
{
    return kind < ConvexKind::Support;
}

/// Whether scaling or setMargin() has made the margin of a box or a cylinder larger than a half extent. Bullet's half
/// extents without margin are then negative, and no core.
inline bool isThinnerThanMargin(const btConvexInternalShape& shape)
{
    Components halfExtents;
    read(shape.getImplicitShapeDimensions(), halfExtents);
    return (quadBits<btScalar>(halfExtents < Components{}) & 7u) != 0;
}

/// The kind of a shape in its current state.
///
/// Unsupported includes a cylinder thinner than its margin, which Bullet's support function turns inside out, so that
/// it proves no gap, and a capsule with a negative scale, whose radius is negative.
inline ConvexKind convexKindOf(const btConvexShape& shape)
{
    const int type = shape.getShapeType();
    const ConvexKind kind = convexKindOf(type);
    if (kind != ConvexKind::Capsule && type != CYLINDER_SHAPE_PROXYTYPE)
        return kind;
    const auto& internal = static_cast<const btConvexInternalShape&>(shape);
    const bool isInsideOut =
        kind == ConvexKind::Capsule ? internal.getMarginNV() < 0 : isThinnerThanMargin(internal);
    return isInsideOut ? ConvexKind::Unsupported : kind;
}

/// The representation of a box: a cuboid, enlarged by a margin.
struct BoxCore
{
    btVector3 halfExtents;
    btScalar margin;
};

/// The core of a box that is thinner than its margin.
///
/// The margin is a tenth of the smallest half extent, which Bullet itself chooses for a box created with this size: the
/// faces keep their positions, and the core keeps faces to rest on.
BoxCore thinBoxCore(const btBoxShape& box);

/// Distance of a box's faces from those of its core: the box's margin, or that of thinBoxCore().
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
        // Adds 0, or NaN for infinities and NaN; the fourth component is unused.
        sum += point - point;
    }
    return (quadBits<btScalar>(sum == Components{}) & 7u) == 7u;
}

/// Whether the support function is Bullet's own, which only reads the shape; the one of a custom shape may do anything.
bool canRunConcurrently(int shapeType);

/// The core of a polytope kind in world space. Copies nothing but the transform.
///
/// @param use  keeps the reference to the cached hull of a Hull between calls
/// @param pass see HullCache::hullOf
/// @return empty if the shape has no points, they are not finite, or memory ran out
std::optional<PosedShape> poseShape(const btConvexShape& shape, ConvexKind kind, const btTransform& transform,
                                    HullUse& use, std::uint64_t pass);

/// The core of a triangle by its corners; its origin() is the first one, rounded.
PosedShape poseTriangle(const Eigen::Vector3d (&corners)[3]);

/// The vector from a point in world space to the origin() of a core; rounding is relative to the length of the vector.
Eigen::Vector3d offsetToOrigin(const Eigen::Vector3d& from, const btConvexShape& shape, ConvexKind kind,
                               const btTransform& transform);

/// The core of a hull shape, with its current scale, for a known hull.
PosedShape poseHull(const Hull<btScalar>& hull, const btConvexShape& hullShape, const btTransform& transform);

/// The core of a box or sphere for staysSeparated().
///
/// @return false for other kinds, and for a box that is thinner than its margin, whose core is not stored anywhere
bool stretchUnitHull(const btConvexShape& shape, const btTransform& transform, StretchedHull& stretched);

/// The core of a hull, box or sphere for staysSeparated(), without a copy of its transform.
///
/// @return false for kinds without a StretchedHull, and for hulls without points
[[gnu::always_inline]] inline bool stretchShape(const btConvexShape& shape, const btTransform& transform,
                                                HullUse& use, std::uint64_t pass, StretchedHull& stretched)
{
    if (shape.getShapeType() != CONVEX_HULL_SHAPE_PROXYTYPE)
    {
        // A local copy can stay in registers; a value written through a reference cannot.
        StretchedHull unit = {};
        const bool isKnown = stretchUnitHull(shape, transform, unit);
        stretched = unit;
        return isKnown;
    }
    const auto& hull = static_cast<const btConvexHullShape&>(shape);
    stretched = {use.hullOf(hull, pass), &hull.getLocalScalingNV(), &transform};
    return stretched.hull != nullptr && stretched.hull->vertexCount() > 0;
}

/// A shape of kind Support as an argument of the queries of narrow/.
class PosedSupport
{
public:
    /// @param anchor point in world space to which the origin is relative
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
    /// Computes in four lanes that all have a value: compilers that use two lanes at a time may compute with undefined
    /// ones, and raise the floating-point flag of an invalid operation.
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
