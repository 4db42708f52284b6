// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/render/shape_mesh.h"

#include <LinearMath/btConvexHullComputer.h>
#include <btBulletCollisionCommon.h>

#include <algorithm>
#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr int kSides = 24;
constexpr int kDirections = 400;

class TriangleCollector : public btTriangleCallback
{
public:
    void processTriangle(btVector3* corners, int, int) override
    {
        mesh.addFlatTriangle(toEigen(corners[0]), toEigen(corners[1]), toEigen(corners[2]));
    }

    DrawMesh mesh;
};

float f(btScalar x)
{
    return static_cast<float>(x);
}

/// Grows a mesh around its centre so that its faces move outward by the margin on average.
void grow(DrawMesh& mesh, float margin)
{
    if (mesh.positions.empty() || !(margin > 0))
        return;
    Eigen::Vector3f centre = Eigen::Vector3f::Zero();
    for (const Eigen::Vector3f& position : mesh.positions)
        centre += position / static_cast<float>(mesh.positions.size());
    float height = 0;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        height +=
            (mesh.positions[i] - centre).dot(mesh.normals[i]) / static_cast<float>(mesh.positions.size());
    if (!(height > 0))
        return;
    for (Eigen::Vector3f& position : mesh.positions)
        position = centre + (position - centre) * (1 + margin / height);
}

DrawMesh makePolyhedronMesh(const btPolyhedralConvexShape& shape)
{
    std::vector<btVector3> points(static_cast<std::size_t>(shape.getNumVertices()));
    for (int i = 0; i < shape.getNumVertices(); ++i)
        shape.getVertex(i, points[static_cast<std::size_t>(i)]);
    DrawMesh mesh = makeHullMesh(points);
    // The corners of a box include the margin already.
    if (shape.getShapeType() != BOX_SHAPE_PROXYTYPE)
        grow(mesh, f(shape.getMargin()));
    return mesh;
}

/// The hull of support points in directions on a Fibonacci spiral.
DrawMesh makeSupportMesh(const btConvexShape& shape)
{
    std::vector<btVector3> points;
    for (int i = 0; i < kDirections; ++i)
    {
        const double z = 1 - (2.0 * i + 1) / kDirections, angle = 2.399963229728653 * i,
                     r = std::sqrt(1 - z * z);
        points.push_back(shape.localGetSupportingVertex(
            btVector3(btScalar(r * std::cos(angle)), btScalar(r * std::sin(angle)), btScalar(z))));
    }
    return makeHullMesh(points);
}

DrawMesh makeConvexMesh(const btConvexShape& shape)
{
    switch (shape.getShapeType())
    {
        case SPHERE_SHAPE_PROXYTYPE:
        {
            const auto& sphere = static_cast<const btSphereShape&>(shape);
            return makeRevolvedMesh(capsuleOutline(f(sphere.getRadius()), 0, kSides / 2), 1, kSides);
        }
        case CAPSULE_SHAPE_PROXYTYPE:
        {
            const auto& capsule = static_cast<const btCapsuleShape&>(shape);
            return makeRevolvedMesh(
                capsuleOutline(f(capsule.getRadius()), f(capsule.getHalfHeight()), kSides / 2),
                capsule.getUpAxis(), kSides);
        }
        case CYLINDER_SHAPE_PROXYTYPE:
        {
            const auto& cylinder = static_cast<const btCylinderShape&>(shape);
            const int axis = cylinder.getUpAxis();
            const btVector3& half = cylinder.getHalfExtentsWithMargin();
            return makeRevolvedMesh(
                coneOutline(f(half[(axis + 1) % 3]), f(half[(axis + 1) % 3]), f(half[axis])), axis, kSides);
        }
        case CONE_SHAPE_PROXYTYPE:
        {
            const auto& cone = static_cast<const btConeShape&>(shape);
            return makeRevolvedMesh(coneOutline(f(cone.getRadius()), 0, f(cone.getHeight()) / 2),
                                    cone.getConeUpIndex(), kSides);
        }
        default:
            return shape.isPolyhedral()
                       ? makePolyhedronMesh(static_cast<const btPolyhedralConvexShape&>(shape))
                       : makeSupportMesh(shape);
    }
}

DrawMesh makeConcaveMesh(const btConcaveShape& shape)
{
    TriangleCollector taker;
    const btVector3 far(BT_LARGE_FLOAT, BT_LARGE_FLOAT, BT_LARGE_FLOAT);
    shape.processAllTriangles(&taker, -far, far);
    return std::move(taker.mesh);
}

DrawMesh makePlaneMesh(const btStaticPlaneShape& plane, btScalar size)
{
    btVector3 u, v;
    const btVector3& normal = plane.getPlaneNormal();
    btPlaneSpace1(normal, u, v);
    const btVector3 centre = normal * plane.getPlaneConstant();
    u *= size / 2;
    v *= size / 2;
    DrawMesh mesh;
    const Eigen::Vector3f a = toEigen(centre - u - v), b = toEigen(centre + u - v),
                          c = toEigen(centre + u + v), d = toEigen(centre - u + v);
    mesh.addFlatTriangle(a, b, c);
    mesh.addFlatTriangle(a, c, d);
    return mesh;
}

/// A mesh in the frame of its parent.
DrawMesh moved(DrawMesh mesh, const btTransform& transform)
{
    Eigen::Matrix3f turn;
    for (int row = 0; row < 3; ++row)
        turn.row(row) = toEigen(transform.getBasis()[row]).transpose();
    for (Eigen::Vector3f& position : mesh.positions)
        position = turn * position + toEigen(transform.getOrigin());
    for (Eigen::Vector3f& normal : mesh.normals)
        normal = turn * normal;
    return mesh;
}
}  // namespace

DrawMesh makeHullMesh(const std::vector<btVector3>& points)
{
    DrawMesh mesh;
    if (points.size() < 3)
        return mesh;
    btConvexHullComputer hull;
    hull.compute(&points[0].x(), sizeof(btVector3), static_cast<int>(points.size()), 0, 0);
    Eigen::Vector3f centre = Eigen::Vector3f::Zero();
    for (int i = 0; i < hull.vertices.size(); ++i)
        centre += toEigen(hull.vertices[i]) / static_cast<float>(hull.vertices.size());
    for (int face = 0; face < hull.faces.size(); ++face)
    {
        const btConvexHullComputer::Edge* edge = &hull.edges[hull.faces[face]];
        const int first = edge->getSourceVertex();
        const Eigen::Vector3f a = toEigen(hull.vertices[first]);
        for (edge = edge->getNextEdgeOfFace(); edge->getTargetVertex() != first;
             edge = edge->getNextEdgeOfFace())
        {
            const Eigen::Vector3f b = toEigen(hull.vertices[edge->getSourceVertex()]);
            const Eigen::Vector3f c = toEigen(hull.vertices[edge->getTargetVertex()]);
            const bool isOutward = (b - a).cross(c - a).dot(a - centre) >= 0;
            mesh.addFlatTriangle(a, isOutward ? b : c, isOutward ? c : b);
        }
    }
    return mesh;
}

DrawMesh makeShapeMesh(const btCollisionShape& shape, btScalar planeSize)
{
    if (shape.getShapeType() == STATIC_PLANE_PROXYTYPE)
        return makePlaneMesh(static_cast<const btStaticPlaneShape&>(shape), planeSize);
    if (shape.isCompound())
    {
        const auto& compound = static_cast<const btCompoundShape&>(shape);
        DrawMesh mesh;
        for (int i = 0; i < compound.getNumChildShapes(); ++i)
            mesh.append(
                moved(makeShapeMesh(*compound.getChildShape(i), planeSize), compound.getChildTransform(i)));
        return mesh;
    }
    if (shape.isConvex())
        return makeConvexMesh(static_cast<const btConvexShape&>(shape));
    return shape.isConcave() ? makeConcaveMesh(static_cast<const btConcaveShape&>(shape)) : DrawMesh();
}

ShapeMeshes::Look ShapeMeshes::look(const btCollisionShape& shape, btScalar planeSize)
{
    if (shape.getShapeType() == BOX_SHAPE_PROXYTYPE)
        return {Film::kCube, 2 * toEigen(static_cast<const btBoxShape&>(shape).getHalfExtentsWithMargin())};
    if (shape.getShapeType() == SPHERE_SHAPE_PROXYTYPE)
    {
        const float radius = f(static_cast<const btSphereShape&>(shape).getRadius());
        return {Film::kSphere, Eigen::Vector3f::Constant(radius)};
    }
    const auto found = m_looks.find(&shape);
    if (found != m_looks.end())
        return found->second;
    const Look look{static_cast<std::uint32_t>(m_film.meshes.size()), Eigen::Vector3f::Ones()};
    m_film.meshes.push_back(makeShapeMesh(shape, planeSize));
    m_looks.emplace(&shape, look);
    return look;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
