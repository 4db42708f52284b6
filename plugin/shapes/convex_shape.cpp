// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/shapes/convex_shape.h"

#include "cullet/narrow/build/hull_builder.h"

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>

namespace cullet
{
// Instantiated in hull_cache.cpp, since to build hulls takes most of the time to compile either file.
extern template Hull<btScalar> makeHull(const std::vector<Eigen::Matrix<btScalar, 3, 1>>&, HullExtra);

inline namespace CULLET_PRECISION
{
namespace
{
using Vector = PosedShape::Vector;
using Matrix = PosedShape::Matrix;

/// The hulls of which every box, triangle, capsule and sphere core is a linear image, so that no shape needs its own.
struct UnitHulls
{
    Hull<btScalar> cube, triangle, segment, point;

    UnitHulls()
    {
        std::vector<Vector> corners;
        for (int i = 0; i < 8; ++i)
            corners.emplace_back(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
        cube = makeHull(corners);
        triangle = makeHull<btScalar>({Vector(0, 0, 0), Vector(1, 0, 0), Vector(0, 1, 0)});
        segment = makeHull<btScalar>({Vector(-1, 0, 0), Vector(1, 0, 0)});
        point = makeHull<btScalar>({Vector(0, 0, 0)});
    }
};

/// Never destroyed, like the hull cache.
const UnitHulls& unitHulls()
{
    static const UnitHulls* const hulls = new UnitHulls;
    return *hulls;
}

/// The third column of a triangle's map, for edges from one corner: it is only multiplied by zeros, keeps the map free of
/// reflections, and is no longer than an edge, so that the size of the core is a length.
template <class V>
V thirdColumn(const V& ab, const V& ac)
{
    const auto length = ac.cwiseAbs().sum();
    return ab.cross(ac) * (length > 0 ? 1 / length : 0);
}

std::optional<PosedShape> poseTriangle(const btTriangleShape& triangle, const btTransform& transform)
{
    if (!hasFiniteCorners(triangle))
        return {};
    const Vector a = toEigen(triangle.m_vertices1[0]);
    const Vector ab = toEigen(triangle.m_vertices1[1]) - a;
    const Vector ac = toEigen(triangle.m_vertices1[2]) - a;
    Matrix corners;
    corners << ab, ac, thirdColumn(ab, ac);
    return PosedShape(unitHulls().triangle, basisOf(transform) * corners,
                      toEigen(transform(triangle.m_vertices1[0])));
}

PosedShape poseCapsule(const btCapsuleShape& capsule, const btTransform& transform)
{
    const Matrix basis = basisOf(transform);
    const int up = capsule.getUpAxis();
    const btScalar half = capsule.getHalfHeight();
    // The other columns are only multiplied by zeros; they are as long, so that the size of the core is a length.
    const btScalar across = half > 0 ? half : btScalar(1);
    Matrix turned;
    turned << basis.col(up) * half, basis.col((up + 1) % 3) * across, basis.col((up + 2) % 3) * across;
    return {unitHulls().segment, turned, toEigen(transform.getOrigin())};
}

std::optional<PosedShape> poseHullShape(const btConvexHullShape& shape, const btTransform& transform,
                                        HullUse& use, std::uint64_t pass)
{
    const Hull<btScalar>* hull = use.hullOf(shape, pass);
    if (hull == nullptr || hull->vertexCount() == 0)
        return {};
    return poseHull(*hull, shape, transform);
}

PosedShape poseStretched(const Hull<btScalar>& hull, const btVector3& stretch, const btTransform& transform)
{
    Components rows[3], origin, scale;
    read(stretch, scale);
    for (int i = 0; i < 3; ++i)
    {
        read(transform.getBasis()[i], rows[i]);
        rows[i] *= scale;
        Quad<btScalar>::clearLast(rows[i]);
    }
    read(transform.getOrigin(), origin);
    Quad<btScalar>::clearLast(origin);
    return {hull, rows, origin};
}

PosedShape poseBox(const btBoxShape& box, const btTransform& transform)
{
    if (isThinnerThanMargin(box))
        return poseStretched(unitHulls().cube, thinBoxCore(box).halfExtents, transform);
    return poseStretched(unitHulls().cube, box.getImplicitShapeDimensions(), transform);
}
}  // namespace

Eigen::Matrix<btScalar, 3, 3> basisOf(const btTransform& transform)
{
    const btMatrix3x3& m = transform.getBasis();
    Matrix basis;
    for (int row = 0; row < 3; ++row)
        basis.row(row) << m[row].x(), m[row].y(), m[row].z();
    return basis;
}

BoxCore thinBoxCore(const btBoxShape& box)
{
    const btScalar own = box.getMarginNV();
    btVector3 halfExtents = box.getImplicitShapeDimensions() + btVector3(own, own, own);
    // An inverted box becomes a point.
    halfExtents.setMax(btVector3(0, 0, 0));
    const btScalar margin = btScalar(0.1) * halfExtents[halfExtents.minAxis()];
    return {halfExtents - btVector3(margin, margin, margin), margin};
}

PosedShape poseHull(const Hull<btScalar>& hull, const btConvexShape& hullShape, const btTransform& transform)
{
    return poseStretched(hull, static_cast<const btConvexHullShape&>(hullShape).getLocalScalingNV(),
                         transform);
}

bool canRunConcurrently(int shapeType)
{
    switch (convexKindOf(shapeType))
    {
        case ConvexKind::Unsupported:
            return false;
        case ConvexKind::Support:
            return shapeType == CYLINDER_SHAPE_PROXYTYPE || shapeType == CONE_SHAPE_PROXYTYPE ||
                   shapeType == MULTI_SPHERE_SHAPE_PROXYTYPE ||
                   shapeType == CONVEX_POINT_CLOUD_SHAPE_PROXYTYPE;
        default:
            return true;
    }
}

std::optional<PosedShape> poseShape(const btConvexShape& shape, ConvexKind kind, const btTransform& transform,
                                    HullUse& use, std::uint64_t pass)
{
    switch (kind)
    {
        case ConvexKind::Hull:
            return poseHullShape(static_cast<const btConvexHullShape&>(shape), transform, use, pass);
        case ConvexKind::Box:
            return poseBox(static_cast<const btBoxShape&>(shape), transform);
        case ConvexKind::Triangle:
            return poseTriangle(static_cast<const btTriangleShape&>(shape), transform);
        case ConvexKind::Capsule:
            return poseCapsule(static_cast<const btCapsuleShape&>(shape), transform);
        case ConvexKind::Sphere:
            return PosedShape(unitHulls().point, basisOf(transform), toEigen(transform.getOrigin()));
        default:
            return {};
    }
}

PosedShape poseTriangle(const Eigen::Vector3d (&corners)[3])
{
    const Eigen::Vector3d ab = corners[1] - corners[0], ac = corners[2] - corners[0];
    const Eigen::Vector3d across = thirdColumn(ab, ac);
    const auto scalar = [](double x) { return static_cast<btScalar>(x); };
    Components rows[3];
    for (int i = 0; i < 3; ++i)
        rows[i] = Components{scalar(ab[i]), scalar(ac[i]), scalar(across[i]), 0};
    const Components origin = {scalar(corners[0][0]), scalar(corners[0][1]), scalar(corners[0][2]), 0};
    return {unitHulls().triangle, rows, origin};
}

Eigen::Vector3d offsetToOrigin(const Eigen::Vector3d& from, const btConvexShape& shape, ConvexKind kind,
                               const btTransform& transform)
{
    const Eigen::Vector3d offset = toEigen(transform.getOrigin()).cast<double>() - from;
    if (kind != ConvexKind::Triangle)
        return offset;
    const Vector corner = toEigen(static_cast<const btTriangleShape&>(shape).m_vertices1[0]);
    return offset + basisOf(transform).cast<double>() * corner.cast<double>();
}

bool stretchUnitHull(const btConvexShape& shape, const btTransform& transform, StretchedHull& stretched)
{
    static const btVector3 kUnit(1, 1, 1);
    switch (shape.getShapeType())
    {
        case BOX_SHAPE_PROXYTYPE:
        {
            const auto& box = static_cast<const btBoxShape&>(shape);
            if (isThinnerThanMargin(box))
                return false;
            stretched = {&unitHulls().cube, &box.getImplicitShapeDimensions(), &transform};
            return true;
        }
        case SPHERE_SHAPE_PROXYTYPE:
            stretched = {&unitHulls().point, &kUnit, &transform};
            return true;
        default:
            return false;
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
