// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/shapes/shape_hash.h"

#include "cullet/plugin/core/mix_bits.h"
#include "cullet/plugin/shapes/convex_shape.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btPolyhedralConvexShape.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Whether all that a contact depends on is read below.
bool isKnown(ConvexKind kind)
{
    return isPolytope(kind) && kind != ConvexKind::Triangle;
}

std::uint64_t hashOf(const btVector3& v)
{
    return mixBits(mixBits(bitsOf(v.x()), bitsOf(v.y())), bitsOf(v.z()));
}

/// What differs by kind: the points of a hull, the axis of a capsule, and faces that the application had computed.
std::uint64_t hashOfKind(const btConvexInternalShape& shape, ConvexKind kind, HullUse& hull,
                         std::uint64_t pass) noexcept
{
    if (kind == ConvexKind::Capsule)
        return std::uint64_t(static_cast<const btCapsuleShape&>(shape).getUpAxis()) + 1;
    if (kind == ConvexKind::Sphere)
        return 1;
    const std::uint64_t faces =
        bitsOf(static_cast<const btPolyhedralConvexShape&>(shape).getConvexPolyhedron());
    if (kind == ConvexKind::Box)
        return mixBits(faces, 1) | 1;
    const auto& points = static_cast<const btConvexHullShape&>(shape);
    return hull.hullOf(points, pass) == nullptr ? 0 : mixBits(faces, hull.revision()) | 1;
}

btScalar largestOf(const btVector3& v)
{
    return std::max({std::abs(v.x()), std::abs(v.y()), std::abs(v.z())});
}
}  // namespace

std::uint64_t hashOfShape(const btCollisionShape& shape, HullUse& hull, std::uint64_t pass) noexcept
{
    const int type = shape.getShapeType();
    const std::uint64_t identity = mixBits(bitsOf(&shape), std::uint64_t(type));
    if (shape.isConcave())
        return mixBits(identity, bitsOf(shape.getMargin())) | 1;
    const ConvexKind kind = convexKindOf(type);
    if (!isKnown(kind))
        return 0;
    const auto& convex = static_cast<const btConvexInternalShape&>(shape);
    const std::uint64_t ofKind = hashOfKind(convex, kind, hull, pass);
    const std::uint64_t sizes =
        mixBits(hashOf(convex.getImplicitShapeDimensions()),
                mixBits(hashOf(convex.getLocalScalingNV()), bitsOf(convex.getMarginNV())));
    return ofKind == 0 ? 0 : mixBits(identity, mixBits(ofKind, sizes)) | 1;
}

btScalar radiusOfShape(const btCollisionShape& shape, HullUse& hull, std::uint64_t pass) noexcept
{
    constexpr btScalar kInfinite = std::numeric_limits<btScalar>::infinity();
    const ConvexKind kind = convexKindOf(shape.getShapeType());
    if (!isKnown(kind))
        return kInfinite;
    const auto& convex = static_cast<const btConvexInternalShape&>(shape);
    const btVector3& size = convex.getImplicitShapeDimensions();
    const btScalar margin = std::abs(convex.getMarginNV());
    if (kind == ConvexKind::Box)
        return size.length() + 2 * margin;
    if (kind == ConvexKind::Capsule)
        return std::abs(size[static_cast<const btCapsuleShape&>(shape).getUpAxis()]) + margin;
    const btScalar scale = largestOf(convex.getLocalScalingNV());
    if (kind == ConvexKind::Sphere)
        return std::abs(size.x()) * scale;
    const Hull<btScalar>* const points = hull.hullOf(static_cast<const btConvexHullShape&>(shape), pass);
    return points == nullptr ? kInfinite : scale * static_cast<btScalar>(points->radius()) + margin;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
