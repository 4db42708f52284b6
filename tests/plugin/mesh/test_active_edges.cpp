// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/active_edges.h"

#include <BulletCollision/CollisionDispatch/btInternalEdgeUtility.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleInfoMap.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace cullet::test
{
namespace
{
using Eigen::Vector3d;

struct Mesh
{
    struct Triangle
    {
        btVector3 corners[3];
        int index;
    };

    void add(const Vector3d& a, const Vector3d& b, const Vector3d& c)
    {
        Triangle triangle;
        triangle.index = static_cast<int>(triangles.size());
        int i = 0;
        for (const Vector3d* corner : {&a, &b, &c})
            triangle.corners[i++] =
                btVector3(btScalar(corner->x()), btScalar(corner->y()), btScalar(corner->z()));
        triangles.push_back(triangle);
    }
    TriangleView view() const
    {
        return {triangles[0].corners, sizeof(Triangle), static_cast<int>(triangles.size())};
    }
    Vector3d corner(int triangle, int i) const
    {
        const btVector3& v = triangles[static_cast<std::size_t>(triangle)].corners[i];
        return {double(v.x()), double(v.y()), double(v.z())};
    }

    std::vector<Triangle> triangles;
};

/// A lattice of cells of a metre around the origin, with a height for each corner.
template <class Height>
Mesh latticeOf(int reach, const Height& height)
{
    Mesh mesh;
    const auto at = [&](int x, int z) { return Vector3d(x, height(x, z), z); };
    for (int x = -reach; x < reach; ++x)
    {
        for (int z = -reach; z < reach; ++z)
        {
            mesh.add(at(x, z), at(x, z + 1), at(x + 1, z));
            mesh.add(at(x + 1, z), at(x, z + 1), at(x + 1, z + 1));
        }
    }
    return mesh;
}

Mesh flatLattice()
{
    return latticeOf(3, [](int, int) { return 0.0; });
}

/// Two squares of two triangles that share the edge x = 0 and fall off from it, or rise, by an angle each.
Mesh roof(double degrees)
{
    const double drop = -std::tan(degrees * 3.14159265358979 / 180.0);
    Mesh mesh;
    for (const double side : {-1.0, 1.0})
    {
        const Vector3d a(0, 0, -1), b(0, 0, 1), c(side, drop, -1), d(side, drop, 1);
        mesh.add(a, b, c);
        mesh.add(c, b, d);
    }
    return mesh;
}

/// Closest point of a triangle (Ericson 2005, 5.1.5).
Vector3d closestPoint(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c)
{
    const Vector3d normal = (b - a).cross(c - a);
    const std::array<Vector3d, 3> corners = {{a, b, c}};
    Vector3d best = a;
    bool isInside = normal.squaredNorm() > 0.0;
    for (std::size_t i = 0; i < 3; ++i)
    {
        const Vector3d &from = corners[i], edge = corners[(i + 1) % 3] - from;
        isInside = isInside && normal.cross(edge).dot(p - from) >= 0.0;
        const double length2 = edge.squaredNorm();
        const double place = length2 > 0.0 ? std::clamp((p - from).dot(edge) / length2, 0.0, 1.0) : 0.0;
        const Vector3d candidate = from + place * edge;
        if ((candidate - p).squaredNorm() < (best - p).squaredNorm())
            best = candidate;
    }
    return isInside ? Vector3d(p - normal * (normal.dot(p - a) / normal.squaredNorm())) : best;
}

TriangleContact contactOf(const Mesh& mesh, int triangle, const Vector3d& point)
{
    const Vector3d on =
        closestPoint(point, mesh.corner(triangle, 0), mesh.corner(triangle, 1), mesh.corner(triangle, 2));
    return {(point - on).normalized(), on, (point - on).norm()};
}

struct Corrected
{
    EdgeVerdict verdict;
    TriangleContact contact;
};

/// The contact of a point, as the core of a sphere.
Corrected correct(const Mesh& mesh, int triangle, const Vector3d& point)
{
    Corrected result = {EdgeVerdict::Keep, contactOf(mesh, triangle, point)};
    result.verdict = correctAtEdges(mesh.view(), triangle, point, result.contact);
    return result;
}

/// The contact of overlapping cores.
Corrected correctDeep(const Mesh& mesh, int triangle, const Vector3d& inside, const TriangleContact& contact)
{
    Corrected result = {EdgeVerdict::Keep, contact};
    result.verdict = correctAtEdges(mesh.view(), triangle, inside, result.contact);
    return result;
}

int closestTriangle(const Mesh& mesh, const Vector3d& point)
{
    int best = 0;
    for (int i = 1; i < mesh.view().count; ++i)
    {
        if (contactOf(mesh, i, point).distance < contactOf(mesh, best, point).distance)
            best = i;
    }
    return best;
}

void expectNear(const Vector3d& a, const Vector3d& b, double tolerance = 1e-6)
{
    EXPECT_NEAR((a - b).norm(), 0.0, tolerance) << a.transpose() << " and " << b.transpose();
}

/// The normal of the right side of roof(degrees), that of triangle 2; triangle 0 is on the left.
Vector3d slope(double degrees)
{
    const double angle = degrees * 3.14159265358979 / 180.0;
    return {std::sin(angle), std::cos(angle), 0.0};
}

TEST(ActiveEdges, KeepContactOnFace)
{
    const Mesh mesh = flatLattice();
    const Vector3d point(0.25, 0.5, 0.25);
    const Corrected result = correct(mesh, closestTriangle(mesh, point), point);
    EXPECT_EQ(result.verdict, EdgeVerdict::Keep);
    expectNear(result.contact.normal, Vector3d::UnitY());
}

TEST(ActiveEdges, LeaveFaceNormalsOnlyWhenMeshIsFlat)
{
    const Mesh mesh = flatLattice();
    constexpr unsigned kSeed = 4101;
    std::mt19937 engine(kSeed);
    std::uniform_real_distribution<double> place(-1.5, 1.5), height(0.01, 1.0);
    int skipped = 0, turned = 0, kept = 0;
    for (int i = 0; i < 200; ++i)
    {
        const double x = place(engine), z = place(engine), sign = i % 2 == 0 ? 1.0 : -1.0;
        const double y = sign * height(engine);
        const Vector3d point(x, y, z);
        int here = 0;
        for (int triangle = 0; triangle < mesh.view().count; ++triangle)
        {
            // Triangles at the rim have edges without neighbours.
            if (contactOf(mesh, triangle, point).distance > std::abs(y) + 1.0)
                continue;
            const Corrected result = correct(mesh, triangle, point);
            skipped += result.verdict == EdgeVerdict::Skip ? 1 : 0;
            turned += result.verdict == EdgeVerdict::Turn ? 1 : 0;
            if (result.verdict == EdgeVerdict::Skip)
                continue;
            ++here;
            expectNear(result.contact.normal, sign * Vector3d::UnitY(), 2e-4);
            EXPECT_NEAR(result.contact.distance, std::abs(y), 1e-6) << "seed " << kSeed << ", case " << i;
        }
        kept += here > 0 ? 1 : 0;
    }
    EXPECT_EQ(kept, 200) << "seed " << kSeed;
    EXPECT_GT(skipped, 400);
    EXPECT_GT(turned, 4);
}

TEST(ActiveEdges, NeverSkipClosestTriangle)
{
    constexpr unsigned kSeed = 4102;
    std::mt19937 engine(kSeed);
    std::uniform_real_distribution<double> bump(-0.6, 0.6), place(-1.8, 1.8), height(-1.5, 1.5);
    int skipped = 0, keptOffFace = 0;
    for (int world = 0; world < 8; ++world)
    {
        std::array<std::array<double, 5>, 5> heights;
        for (auto& row : heights)
        {
            for (double& h : row)
                h = bump(engine);
        }
        const Mesh mesh =
            latticeOf(2, [&](int x, int z)
                      { return heights[static_cast<std::size_t>(x + 2)][static_cast<std::size_t>(z + 2)]; });
        for (int i = 0; i < 50; ++i)
        {
            const double x = place(engine), y = height(engine), z = place(engine);
            const Vector3d point(x, y, z);
            const int closest = closestTriangle(mesh, point);
            const double least = contactOf(mesh, closest, point).distance;
            for (int triangle = 0; triangle < mesh.view().count; ++triangle)
            {
                const TriangleContact before = contactOf(mesh, triangle, point);
                const Corrected result = correct(mesh, triangle, point);
                if (result.verdict == EdgeVerdict::Skip)
                {
                    ++skipped;
                    EXPECT_GT(before.distance, least + 1e-8) << "seed " << kSeed << ", world " << world;
                }
                keptOffFace += result.verdict == EdgeVerdict::Keep && triangle == closest ? 1 : 0;
                EXPECT_NEAR(result.contact.normal.norm(), 1.0, 1e-6);
                EXPECT_LE(result.contact.distance, before.distance + 1e-9);
            }
        }
    }
    EXPECT_GT(skipped, 2000) << "seed " << kSeed;
    EXPECT_GT(keptOffFace, 200);
}

TEST(ActiveEdges, KeepDistanceAboveThatOfCoresAlongNewNormal)
{
    // The core is a segment whose lower end is the closest point.
    const Mesh mesh = flatLattice();
    const Vector3d low(0.3, 0.2, 0.3), high(0.6, 0.9, 0.2);
    for (int triangle = 0; triangle < mesh.view().count; ++triangle)
    {
        const Corrected result = correct(mesh, triangle, low);
        const double ofCores = std::min(result.contact.normal.dot(low), result.contact.normal.dot(high)) -
                               std::max({result.contact.normal.dot(mesh.corner(triangle, 0)),
                                         result.contact.normal.dot(mesh.corner(triangle, 1)),
                                         result.contact.normal.dot(mesh.corner(triangle, 2))});
        EXPECT_GE(result.contact.distance, ofCores - 1e-9) << triangle;
    }
}

TEST(ActiveEdges, KeepNormalBetweenFacesOfRidge)
{
    const Mesh mesh = roof(30);
    const Vector3d point(0.02, 0.2, 0.1);
    for (const int triangle : {0, 2})
    {
        const Corrected result = correct(mesh, triangle, point);
        EXPECT_EQ(result.verdict, EdgeVerdict::Keep) << triangle;
    }
}

TEST(ActiveEdges, SkipTriangleBehindRidgeWhenOtherSideIsCloser)
{
    const Mesh mesh = roof(30);
    const Vector3d point = 0.2 * slope(30) + 0.3 * Vector3d(std::cos(0.5236), -std::sin(0.5236), 0);
    EXPECT_EQ(closestTriangle(mesh, point), 2);
    EXPECT_EQ(correct(mesh, 0, point).verdict, EdgeVerdict::Skip);
    EXPECT_EQ(correct(mesh, 2, point).verdict, EdgeVerdict::Keep);
}

TEST(ActiveEdges, ClampOverlapToNeighbourOfRidge)
{
    const Mesh mesh = roof(30);
    const TriangleContact contact = {slope(80), Vector3d(0, 0, 0.1), -0.05};
    const Corrected result = correctDeep(mesh, 0, Vector3d(0.1, 0.3, 0.1), contact);
    EXPECT_EQ(result.verdict, EdgeVerdict::Turn);
    expectNear(result.contact.normal, slope(30));
    EXPECT_NEAR(result.contact.distance, -0.05 * std::cos(50 * 3.14159265358979 / 180), 1e-6);
}

TEST(ActiveEdges, TurnNormalToFaceWhenRidgeIsNearlyFlat)
{
    const Mesh mesh = roof(2);
    const Vector3d point(0.0, 0.5, 0.1);
    for (const int triangle : {0, 2})
    {
        const Corrected result = correct(mesh, triangle, point);
        EXPECT_EQ(result.verdict, EdgeVerdict::Turn) << triangle;
        expectNear(result.contact.normal, slope(triangle == 0 ? -2 : 2));
    }
}

TEST(ActiveEdges, SkipPlaneAboveNearlyFlatRidge)
{
    // The plane of the left side is above the right side.
    const Mesh mesh = roof(2);
    EXPECT_EQ(correct(mesh, 0, 0.5 * slope(4)).verdict, EdgeVerdict::Skip);
}

TEST(ActiveEdges, SkipOrTurnInValley)
{
    const Mesh mesh = roof(-30);
    // Over the right side, near the edge.
    const Vector3d point(0.3, 0.4, 0.1);
    EXPECT_EQ(closestTriangle(mesh, point), 2);
    const Corrected left = correct(mesh, 0, point);
    EXPECT_NE(left.verdict, EdgeVerdict::Turn);
    EXPECT_EQ(correct(mesh, 2, point).verdict, EdgeVerdict::Keep);
    const TriangleContact deep = {slope(60), Vector3d(0, 0, 0.1), -0.05};
    const Corrected turned = correctDeep(mesh, 0, point, deep);
    EXPECT_EQ(turned.verdict, EdgeVerdict::Turn);
    expectNear(turned.contact.normal, slope(30));
}

TEST(ActiveEdges, KeepNormalAtTipOfWedge)
{
    // The point is behind the planes of both sides.
    const Mesh mesh = roof(80);
    const Vector3d point(0.0, 0.2, 0.1);
    for (const int triangle : {0, 2})
    {
        EXPECT_EQ(correct(mesh, triangle, point).verdict, EdgeVerdict::Keep) << triangle;
        EXPECT_EQ(correct(mesh, triangle, point + Vector3d(0.1, 0, 0)).verdict, EdgeVerdict::Keep)
            << triangle;
    }
}

TEST(ActiveEdges, TreatBackOfRidgeAsValley)
{
    const Mesh mesh = roof(30);
    const TriangleContact deep = {-slope(-60), Vector3d(0, 0, 0.1), -0.05};
    const Corrected turned = correctDeep(mesh, 0, Vector3d(0.1, -0.5, 0.1), deep);
    EXPECT_EQ(turned.verdict, EdgeVerdict::Turn);
    expectNear(turned.contact.normal, -slope(-30));
}

TEST(ActiveEdges, KeepNormalOfBoundary)
{
    const Mesh mesh = flatLattice();
    // Beside the rim, above and below.
    for (const double y : {0.3, -0.3, 0.0})
    {
        const Vector3d point(3.2, y, 0.4);
        const Corrected result = correct(mesh, closestTriangle(mesh, point), point);
        EXPECT_EQ(result.verdict, EdgeVerdict::Keep) << y;
    }
    // At a corner of the rim, where flat edges meet it.
    const Vector3d beside(3.2, 0.1, 1.0);
    int kept = 0;
    for (int i = 0; i < mesh.view().count; ++i)
    {
        if (contactOf(mesh, i, beside).distance < 0.2237)
            kept += correct(mesh, i, beside).verdict == EdgeVerdict::Keep ? 1 : 0;
    }
    EXPECT_EQ(kept, 3);
}

/// The cube from -1 to 1, two triangles a side.
Mesh cube()
{
    Mesh mesh;
    for (int axis = 0; axis < 3; ++axis)
    {
        for (const double side : {-1.0, 1.0})
        {
            const auto at = [&](double u, double v)
            {
                Vector3d corner;
                corner[axis] = side;
                corner[(axis + 1) % 3] = u;
                corner[(axis + 2) % 3] = v;
                return corner;
            };
            mesh.add(at(-1, -1), at(1, -1), at(1, 1));
            mesh.add(at(-1, -1), at(1, 1), at(-1, 1));
        }
    }
    return mesh;
}

TEST(ActiveEdges, KeepNormalsAtCornerOfCube)
{
    const Mesh mesh = cube();
    const Vector3d point(1.2, 1.3, 1.4);
    int touching = 0;
    for (int i = 0; i < mesh.view().count; ++i)
    {
        if (contactOf(mesh, i, point).distance > 0.54)
            continue;
        ++touching;
        EXPECT_EQ(correct(mesh, i, point).verdict, EdgeVerdict::Keep) << i;
    }
    EXPECT_GE(touching, 3);
}

TEST(ActiveEdges, SkipOtherSidesOfCubeWhenPointIsOverFace)
{
    const Mesh mesh = cube();
    const Vector3d point(0.9, 1.3, 0.7);
    int kept = 0;
    for (int i = 0; i < mesh.view().count; ++i)
    {
        // Sides that share no corner with the top do not know it.
        if (contactOf(mesh, i, point).distance > 0.8)
            continue;
        const Corrected result = correct(mesh, i, point);
        kept += result.verdict == EdgeVerdict::Skip ? 0 : 1;
        if (result.verdict != EdgeVerdict::Skip)
            expectNear(result.contact.normal, Vector3d::UnitY());
    }
    EXPECT_EQ(kept, 1);
}

TEST(ActiveEdges, IgnoreDuplicatesOfTriangle)
{
    Mesh mesh = flatLattice();
    const std::vector<Mesh::Triangle> once = mesh.triangles;
    mesh.triangles.insert(mesh.triangles.end(), once.begin(), once.end());
    // The second time with the other winding.
    for (std::size_t i = once.size(); i < mesh.triangles.size(); ++i)
        std::swap(mesh.triangles[i].corners[0], mesh.triangles[i].corners[2]);
    const Vector3d rim(3.2, 0.3, 0.4);
    EXPECT_EQ(correct(mesh, closestTriangle(mesh, rim), rim).verdict, EdgeVerdict::Keep);
    const Vector3d corner(3.2, 0.1, 1.0);
    EXPECT_EQ(correct(mesh, closestTriangle(mesh, corner), corner).verdict, EdgeVerdict::Keep);
    const Vector3d inner(0.25, 0.5, 0.25);
    const int closest = closestTriangle(mesh, inner);
    int kept = 0;
    for (int i = 0; i < mesh.view().count; ++i)
        kept +=
            contactOf(mesh, i, inner).distance < 1 && correct(mesh, i, inner).verdict == EdgeVerdict::Keep;
    EXPECT_EQ(kept, 2);
    EXPECT_EQ(correct(mesh, closest, inner).verdict, EdgeVerdict::Keep);
}

TEST(ActiveEdges, SkipNeedlesBesideFaceBelow)
{
    // A fan of needles from one corner to a far side.
    Mesh mesh;
    constexpr int kNeedles = 40;
    const auto at = [](int i) { return Vector3d(10, 0, 0.01 * (i - kNeedles / 2)); };
    for (int i = 0; i < kNeedles; ++i)
        mesh.add(Vector3d(-10, 0, 0), at(i), at(i + 1));
    const Vector3d point(5, 0.3, 0.0012);
    int kept = 0;
    for (int i = 0; i < mesh.view().count; ++i)
    {
        const Corrected result = correct(mesh, i, point);
        if (result.verdict == EdgeVerdict::Skip)
            continue;
        ++kept;
        expectNear(result.contact.normal, Vector3d::UnitY(), 2e-4);
    }
    EXPECT_GE(kept, 1);
}

TEST(ActiveEdges, SkipDegenerateTriangleWhenNeighbourIsCloser)
{
    Mesh mesh;
    const Vector3d a(0, 0, -1), b(0, 0, 1), middle(0, 0, 0.2);
    mesh.add(a, b, Vector3d(-1, 0, 0));
    mesh.add(a, middle, Vector3d(1, 0, 0));
    mesh.add(middle, b, Vector3d(1, 0, 0));
    mesh.add(a, middle, b);  // closes the gap at the corner in the edge
    EXPECT_EQ(correct(mesh, 3, Vector3d(-0.2, 0.1, -0.3)).verdict, EdgeVerdict::Skip);
    EXPECT_EQ(correct(mesh, 3, Vector3d(0.2, 0.1, -0.3)).verdict, EdgeVerdict::Skip);
    EXPECT_EQ(correct(mesh, 3, Vector3d(0.0, 0.1, -0.3)).verdict, EdgeVerdict::Keep);
    Mesh alone;
    alone.add(a, middle, b);
    EXPECT_EQ(correct(alone, 0, Vector3d(-0.2, 0.1, -0.3)).verdict, EdgeVerdict::Keep);
}

TEST(ActiveEdges, TurnShallowOverlapToSideOfCore)
{
    const Mesh mesh = flatLattice();
    const Vector3d on(0.5, 0, 0.5);  // on an edge of triangle `touched`
    const int touched = closestTriangle(mesh, Vector3d(0.49, 0, 0.49));
    for (const double side : {1.0, -1.0})
    {
        const TriangleContact contact = {Vector3d(1, 0, 1).normalized(), on, -0.02};
        const Corrected result = correctDeep(mesh, touched, Vector3d(0.6, 0.4 * side, 0.6), contact);
        EXPECT_EQ(result.verdict, EdgeVerdict::Turn);
        expectNear(result.contact.normal, side * Vector3d::UnitY());
        EXPECT_GE(result.contact.distance, -0.02);
    }
}

TEST(ActiveEdges, AreLeftToBulletWhenMeshHasTriangleInfo)
{
    btTriangleMesh triangles;
    triangles.addTriangle(btVector3(0, 0, 0), btVector3(0, 0, 1), btVector3(1, 0, 0));
    triangles.addTriangle(btVector3(1, 0, 0), btVector3(0, 0, 1), btVector3(1, 0, 1));
    btBvhTriangleMeshShape mesh(&triangles, true);
    btScaledBvhTriangleMeshShape scaled(&mesh, btVector3(2, 2, 2));
    const btBoxShape box(btVector3(1, 1, 1));
    EXPECT_FALSE(hasInternalEdges(mesh));
    EXPECT_FALSE(hasInternalEdges(scaled));
    EXPECT_FALSE(hasInternalEdges(box));
    btTriangleInfoMap info;
    btGenerateInternalEdgeInfo(&mesh, &info);
    EXPECT_TRUE(hasInternalEdges(mesh));
    EXPECT_TRUE(hasInternalEdges(scaled));
    const std::array<float, 9> heights = {};
    btHeightfieldTerrainShape field(3, 3, heights.data(), 1, 0, 1, 1, PHY_FLOAT, false);
    EXPECT_FALSE(hasInternalEdges(field));
    field.setTriangleInfoMap(&info);
    EXPECT_TRUE(hasInternalEdges(field));
}
}  // namespace
}  // namespace cullet::test
