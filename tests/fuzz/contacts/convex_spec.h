// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/shapes/convex_shape.h"
#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/fuzz/contacts/signed_distance.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <btBulletCollisionCommon.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

namespace cullet::test
{
enum class SpecKind : std::uint8_t
{
    Hull,
    Box,
    Sphere,
    Capsule,
    Triangle,
    Cylinder,
    Cone,
    MultiSphere,
    kCount
};

inline std::ostream& operator<<(std::ostream& out, const std::array<double, 3>& v)
{
    return out << '(' << v[0] << ' ' << v[1] << ' ' << v[2] << ')';
}

/// One of Bullet's convex shapes as numbers, of which shapes of any size can be made.
struct ConvexSpec
{
    static constexpr std::size_t kMostPoints = 9;

    SpecKind kind = SpecKind::Box;
    std::vector<std::array<double, 3>> points;  ///< of a hull, a triangle or a multisphere
    std::array<double, 3> half = {1, 1, 1};     ///< half extents, or radius and half height
    std::array<double, 3> scaling = {1, 1, 1};  ///< of a hull
    double margin = 0.03125;
    int axis = 1;

    bool isPolytope() const { return kind < SpecKind::Cylinder; }
    bool isRound() const { return kind == SpecKind::Sphere || kind == SpecKind::Capsule; }

    /// @param unit a power of two that multiplies all lengths, exactly
    std::unique_ptr<btConvexShape> make(double unit) const
    {
        std::unique_ptr<btConvexShape> shape = makeBare(unit);
        if (isRound() || kind == SpecKind::MultiSphere)
            return shape;
        shape->setMargin(btScalar(margin * unit));
        // setMargin() adds and subtracts the default margin, which does not scale, to half extents.
        if (kind == SpecKind::Box || kind == SpecKind::Cylinder)
            static_cast<btConvexInternalShape&>(*shape).setImplicitShapeDimensions(at(half, unit));
        if (kind == SpecKind::Hull)
            finish(static_cast<btConvexHullShape&>(*shape), unit);
        return shape;
    }

    /// For messages.
    std::string text() const
    {
        static const char* const kNames[] = {"hull",     "box",      "sphere", "capsule",
                                             "triangle", "cylinder", "cone",   "multisphere"};
        std::ostringstream text;
        text.precision(17);
        text << kNames[static_cast<std::size_t>(kind)] << ", margin " << margin << ", scaling " << scaling
             << ", half " << half << ", points";
        for (const std::array<double, 3>& point : points)
            text << ' ' << point;
        return text.str();
    }

private:
    static btVector3 at(const std::array<double, 3>& v, double unit)
    {
        return vec(v[0] * unit, v[1] * unit, v[2] * unit);
    }

    void finish(btConvexHullShape& hull, double unit) const
    {
        for (const std::array<double, 3>& point : points)
            hull.addPoint(at(point, unit), false);
        hull.setLocalScaling(at(scaling, 1));
        hull.recalcLocalAabb();
    }

    std::unique_ptr<btConvexShape> makeBare(double unit) const
    {
        const btScalar radius = btScalar(half[0] * unit), height = btScalar(2 * half[1] * unit);
        switch (kind)
        {
            case SpecKind::Hull:
                return std::make_unique<btConvexHullShape>();
            case SpecKind::Sphere:
                return std::make_unique<btSphereShape>(radius);
            case SpecKind::Capsule:
                return makeAlongAxis<btCapsuleShapeX, btCapsuleShape, btCapsuleShapeZ>(radius, height);
            case SpecKind::Cone:
                return makeAlongAxis<btConeShapeX, btConeShape, btConeShapeZ>(radius, height);
            case SpecKind::Triangle:
                return std::make_unique<btTriangleShape>(at(points[0], unit), at(points[1], unit),
                                                         at(points[2], unit));
            case SpecKind::Cylinder:
                return makeCylinder(at(half, unit));
            case SpecKind::MultiSphere:
                return makeMultiSphere(unit);
            default:
                return std::make_unique<btBoxShape>(at(half, unit));
        }
    }

    template <class X, class Y, class Z>
    std::unique_ptr<btConvexShape> makeAlongAxis(btScalar radius, btScalar height) const
    {
        if (axis == 0)
            return std::make_unique<X>(radius, height);
        if (axis == 1)
            return std::make_unique<Y>(radius, height);
        return std::make_unique<Z>(radius, height);
    }

    std::unique_ptr<btConvexShape> makeCylinder(const btVector3& extents) const
    {
        if (axis == 0)
            return std::make_unique<btCylinderShapeX>(extents);
        if (axis == 1)
            return std::make_unique<btCylinderShape>(extents);
        return std::make_unique<btCylinderShapeZ>(extents);
    }

    std::unique_ptr<btConvexShape> makeMultiSphere(double unit) const
    {
        const btVector3 centres[] = {at(points[0], unit), at(points[1], unit)};
        const btScalar radii[] = {btScalar(half[0] * unit), btScalar(half[1] * unit)};
        return std::make_unique<btMultiSphereShape>(centres, radii, 2);
    }
};

/// The core of a polytope, from the numbers in the shape as Bullet rounded them, and the margin around it.
struct PolytopeCore
{
    PolytopeCore(const btConvexShape& shape, const btTransform& transform, const btVector3& from)
        : margin(marginOfCore(shape))
    {
        LongMatrix basis;
        LongVector origin;
        for (int row = 0; row < 3; ++row)
        {
            for (int column = 0; column < 3; ++column)
                basis(row, column) = transform.getBasis()[row][column];
            origin[row] = static_cast<long double>(transform.getOrigin()[row]) - from[row];
        }
        for (const LongVector& point : localPoints(shape))
        {
            points.push_back(basis * point + origin);
            radius = std::max(radius, (basis * point).norm());
        }
    }

    LongPoints points;  ///< world axes, relative to `from`
    long double margin;
    long double radius = 0;  ///< of a ball around the shape's origin

private:
    static long double marginOfCore(const btConvexShape& shape)
    {
        if (shape.getShapeType() == BOX_SHAPE_PROXYTYPE)
            return boxMargin(static_cast<const btBoxShape&>(shape));
        return shape.getMargin();
    }

    static LongVector toLong(const btVector3& v) { return LongVector(v.x(), v.y(), v.z()); }

    static LongPoints localPoints(const btConvexShape& shape)
    {
        LongPoints points;
        switch (shape.getShapeType())
        {
            case CONVEX_HULL_SHAPE_PROXYTYPE:
                return pointsOf(static_cast<const btConvexHullShape&>(shape));
            case BOX_SHAPE_PROXYTYPE:
                return cornersOf(static_cast<const btBoxShape&>(shape));
            case TRIANGLE_SHAPE_PROXYTYPE:
                for (const btVector3& corner : static_cast<const btTriangleShape&>(shape).m_vertices1)
                    points.push_back(toLong(corner));
                return points;
            case CAPSULE_SHAPE_PROXYTYPE:
            {
                const auto& capsule = static_cast<const btCapsuleShape&>(shape);
                LongVector end = LongVector::Zero();
                end[capsule.getUpAxis()] = capsule.getHalfHeight();
                return {end, -end};
            }
            default:
                return {LongVector::Zero()};
        }
    }

    static LongPoints pointsOf(const btConvexHullShape& hull)
    {
        LongPoints points;
        for (int i = 0; i < hull.getNumPoints(); ++i)
            points.push_back(
                toLong(hull.getUnscaledPoints()[i]).cwiseProduct(toLong(hull.getLocalScalingNV())));
        return points;
    }

    static LongPoints cornersOf(const btBoxShape& box)
    {
        const LongVector half = toLong(isThinnerThanMargin(box) ? thinBoxCore(box).halfExtents
                                                                : box.getImplicitShapeDimensions());
        LongPoints points;
        for (int i = 0; i < 8; ++i)
        {
            const LongVector signs(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
            points.push_back(half.cwiseProduct(signs));
        }
        return points;
    }
};
}  // namespace cullet::test
