// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/shapes/convex_mesh_hull.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/convex/convex_contacts.h"
#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/plugin/mesh/mesh_bench.h"

#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// A tetrahedron whose vertices the application can move.
struct Wedge
{
    std::vector<btScalar> vertices = {
        btScalar(-0.5), 0, btScalar(-0.5), btScalar(0.5), 0, btScalar(-0.5), 0, 0, btScalar(0.5), 0,
        btScalar(0.75), 0};
    std::vector<int> indices = {0, 1, 2, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    btTriangleIndexVertexArray arrays{4, indices.data(),  3 * int(sizeof(int)),
                                      4, vertices.data(), 3 * int(sizeof(btScalar))};
    btConvexTriangleMeshShape shape{&arrays, true};
};

/// One large triangle.
struct Floor
{
    Floor()
    {
        triangles.addTriangle(vec(-9, 0, -9), vec(0, 0, 9), vec(9, 0, -9));
        shape = std::make_unique<btBvhTriangleMeshShape>(&triangles, true);
    }
    btTriangleMesh triangles;
    std::unique_ptr<btBvhTriangleMeshShape> shape;
};

/// A ball of 100 triangles.
struct Ball
{
    static constexpr int kRings = 6, kSides = 10;

    Ball()
    {
        for (int ring = 0; ring < kRings; ++ring)
        {
            for (int side = 0; side < kSides; ++side)
            {
                if (ring > 0)
                    triangles.addTriangle(corner(ring, side), corner(ring + 1, side), corner(ring, side + 1));
                if (ring < kRings - 1)
                    triangles.addTriangle(corner(ring, side + 1), corner(ring + 1, side),
                                          corner(ring + 1, side + 1));
            }
        }
        shape = std::make_unique<btConvexTriangleMeshShape>(&triangles, true);
    }
    static btVector3 corner(int ring, int side)
    {
        const double up = SIMD_PI * ring / kRings, around = SIMD_2_PI * (side % kSides) / kSides;
        return vec(0.5 * std::sin(up) * std::cos(around), 0.5 * std::cos(up),
                   0.5 * std::sin(up) * std::sin(around));
    }

    btTriangleMesh triangles;
    std::unique_ptr<btConvexTriangleMeshShape> shape;
};

/// The least distance of contacts; 1 without any.
double deepestOf(const btPersistentManifold* manifold)
{
    double least = 1;
    for (int i = 0; manifold != nullptr && i < manifold->getNumContacts(); ++i)
        least = std::min(least, double(manifold->getContactPoint(i).getDistance()));
    return least;
}
}  // namespace

// In both orders, beside shapes of all kinds and another mesh.
TEST(ConvexMesh, TouchesConvexShapesAsHullOfItsVertices)
{
    Ball ball;
    ASSERT_EQ(ball.triangles.getNumTriangles(), 100);
    ConvexMeshHull cache;
    const btConvexHullShape* const known = cache.hullOf(*ball.shape);
    ASSERT_NE(known, nullptr);
    btConvexHullShape hull(known->getUnscaledPoints()->m_floats, known->getNumPoints());
    btBoxShape box(vec(0.4, 0.3, 0.5));
    btSphereShape sphere(btScalar(0.4));
    btCapsuleShape capsule(btScalar(0.3), btScalar(0.6));
    btCylinderShape cylinder(vec(0.4, 0.3, 0.4));
    ConvexBench bench;
    std::mt19937 engine(43);
    std::uniform_real_distribution<double> apart(0.3, 1.1);
    int points = 0;
    for (btCollisionShape* const other :
         {static_cast<btCollisionShape*>(&box), static_cast<btCollisionShape*>(&sphere),
          static_cast<btCollisionShape*>(&capsule), static_cast<btCollisionShape*>(&cylinder),
          static_cast<btCollisionShape*>(ball.shape.get()), static_cast<btCollisionShape*>(&hull)})
    {
        btCollisionShape& otherOfHull = other == ball.shape.get() ? hull : *other;
        for (int i = 0; i < 100; ++i)
        {
            SCOPED_TRACE("seed 43, shape " + std::string(other->getName()) + ", pose " + std::to_string(i));
            const btTransform at(randomRotation(engine), vec(0, 0, 0)),
                there(randomRotation(engine), vec(0.1, apart(engine), 0.2));
            const bool isSwapped = i % 2 == 1;
            ConvexPairProbe asMesh(bench.dispatcher, isSwapped ? *other : *ball.shape,
                                   isSwapped ? *ball.shape : *other);
            ConvexPairProbe asHull(bench.dispatcher, isSwapped ? otherOfHull : hull,
                                   isSwapped ? hull : otherOfHull);
            asMesh.place(at, there);
            asHull.place(at, there);
            const btPersistentManifold &ofMesh = *asMesh.step(), &ofHull = *asHull.step();
            ASSERT_TRUE(arePointsEqual(ofMesh, ofHull));
            points += ofMesh.getNumContacts();
        }
    }
    EXPECT_GT(points, 400);
}

// Bullet's manifold gathers a point a step; the deepest is as deep.
TEST(ConvexMesh, TouchesConvexShapesAsDeepAsWithBullet)
{
    Ball ball;
    btBoxShape box(vec(0.4, 0.3, 0.5));
    ConvexBench ours, stock(true);
    std::mt19937 engine(44);
    std::uniform_real_distribution<double> apart(0.6, 0.9);
    int touching = 0;
    for (int i = 0; i < 200; ++i)
    {
        ConvexPairProbe own(ours.dispatcher, *ball.shape, box), bullets(stock.dispatcher, *ball.shape, box);
        const btTransform at(randomRotation(engine), vec(0, 0, 0)),
            there(randomRotation(engine), vec(0, apart(engine), 0));
        own.place(at, there);
        bullets.place(at, there);
        const double deepest = deepestOf(bullets.step());
        EXPECT_LE(deepestOf(own.step()), deepest + 0.002) << "seed 44, pose " << i;
        touching += deepest < 1 ? 1 : 0;
    }
    EXPECT_GT(touching, 50);
}

TEST(ConvexMesh, NoticesMovedVertexBesideConvexShapeInSameStep)
{
    Wedge wedge;
    btBoxShape box(vec(2, 1, 2));
    ConvexBench bench;
    ConvexPairProbe probe(bench.dispatcher, wedge.shape, box);
    probe.place(vec(0, 0.3, 0), vec(0, -1, 0));
    EXPECT_EQ(deepestOf(probe.step()), 1);
    wedge.vertices[1] = btScalar(-0.3);
    EXPECT_NEAR(deepestOf(probe.step()), -wedge.shape.getMargin(), 1e-3);
    wedge.shape.setLocalScaling(vec(1, 1.2, 1));
    EXPECT_NEAR(deepestOf(probe.step()), -0.06 - wedge.shape.getMargin(), 1e-3);
    wedge.shape.setMargin(btScalar(0.1));
    EXPECT_NEAR(deepestOf(probe.step()), -0.16, 1e-3);
    btSphereShape sphere(btScalar(0.25));
    probe.bodyA.setCollisionShape(&sphere);
    // Its points would stay while the bodies do not move, as in Bullet.
    probe.step()->clearManifold();
    EXPECT_EQ(deepestOf(probe.step()), 1) << "the shape of the body was exchanged";
    probe.bodyA.setCollisionShape(&wedge.shape);
    EXPECT_NEAR(deepestOf(probe.step()), -0.16, 1e-3);
}

// The next hull is often where the last one was, whose points are then the known ones.
TEST(ConvexMesh, NoticesMovedVertexAlsoWhenPointsOfHullsAreNotCompared)
{
    Wedge wedge;
    btBoxShape box(vec(2, 1, 2));
    IsaGjkOptions options;
    options.checkPoints = false;
    ConvexBench bench(false, options);
    ConvexPairProbe probe(bench.dispatcher, wedge.shape, box);
    probe.place(vec(0, 0.3, 0), vec(0, -1, 0));
    EXPECT_EQ(deepestOf(probe.step()), 1);
    wedge.vertices[1] = btScalar(-0.3);
    EXPECT_NEAR(deepestOf(probe.step()), -wedge.shape.getMargin(), 1e-3);
}

// Its vertices are not read, so that no hull takes its place.
TEST(ConvexMesh, IsLeftToBulletBesideConvexShapeWhenItHasNoHullOrFaces)
{
    Wedge wedge;
    btBoxShape box(vec(2, 1, 2));
    ConvexBench bench;
    ConvexPairProbe probe(bench.dispatcher, wedge.shape, box);
    probe.place(vec(0, 0.02, 0), vec(0, -1, 0));
    probe.step();
    EXPECT_EQ(bench.registration->stats().delegatedTotal, 0u);
    wedge.vertices[10] = std::numeric_limits<btScalar>::quiet_NaN();
    probe.step();
    EXPECT_EQ(bench.registration->stats().delegatedTotal, 1u) << "a vertex is not finite";
    wedge.vertices[10] = btScalar(0.75);
    ASSERT_TRUE(wedge.shape.initializePolyhedralFeatures());
    probe.step();
    EXPECT_EQ(bench.registration->stats().delegatedTotal, 2u) << "the application had faces computed";
}

TEST(ConvexMesh, TouchesMeshAsHullOfItsVertices)
{
    Wedge wedge;
    Floor floor;
    ConvexMeshHull cache;
    ASSERT_TRUE(ConvexMeshHull::isPossible(wedge.shape));
    const btConvexHullShape* const known = cache.hullOf(wedge.shape);
    ASSERT_NE(known, nullptr);
    EXPECT_EQ(known->getNumPoints(), 4);
    btConvexHullShape hull(known->getUnscaledPoints()->m_floats, known->getNumPoints());
    MeshBench asMesh(Loop::Ours, wedge.shape, *floor.shape), asHull(Loop::Ours, hull, *floor.shape);
    std::mt19937 engine(41);
    std::uniform_real_distribution<double> height(-0.1, 0.3);
    int points = 0;
    for (int i = 0; i < 200; ++i)
    {
        const btQuaternion turn = i % 2 == 0 ? btQuaternion::getIdentity() : randomRotation(engine);
        const btTransform at(turn, vec(0.1, height(engine), 0.2));
        const btPersistentManifold& a = asMesh.stepFromNothing(at, btTransform::getIdentity());
        const btPersistentManifold& b = asHull.stepFromNothing(at, btTransform::getIdentity());
        ASSERT_TRUE(arePointsEqual(a, b)) << "seed 41, pose " << i;
        points += a.getNumContacts();
    }
    EXPECT_GT(points, 100);
}

TEST(ConvexMesh, NoticesMovedVertexAndScaleInSameStep)
{
    Wedge wedge;
    Floor floor;
    MeshBench bench(Loop::Ours, wedge.shape, *floor.shape);
    const btTransform at(btQuaternion::getIdentity(), vec(0, 0.3, 0)), origin = btTransform::getIdentity();
    EXPECT_EQ(bench.step(at, origin).getNumContacts(), 0);
    wedge.vertices[1] = btScalar(-0.25);
    wedge.shape.recalcLocalAabb();
    ASSERT_EQ(bench.step(at, origin).getNumContacts(), 1);
    const btScalar before = bench.manifold().getContactPoint(0).getDistance();
    wedge.shape.setLocalScaling(vec(1, 1.2, 1));
    ASSERT_EQ(bench.step(at, origin).getNumContacts(), 1);
    EXPECT_LT(bench.manifold().getContactPoint(0).getDistance(), before - btScalar(0.04));
}

TEST(ConvexMesh, IsLeftToBulletWhenShapeIsOfApplication)
{
    struct Own : btConvexTriangleMeshShape
    {
        using btConvexTriangleMeshShape::btConvexTriangleMeshShape;
    };
    Wedge wedge;
    Own own(&wedge.arrays, true);
    EXPECT_FALSE(ConvexMeshHull::isPossible(own));
    EXPECT_FALSE(ConvexMeshHull::isPossible(btBoxShape(vec(1, 1, 1))));
}

TEST(ConvexMesh, HasNoHullWhenVertexIsNotFinite)
{
    Wedge wedge;
    ConvexMeshHull cache;
    ASSERT_NE(cache.hullOf(wedge.shape), nullptr);
    wedge.vertices[4] = std::numeric_limits<btScalar>::quiet_NaN();
    EXPECT_EQ(cache.hullOf(wedge.shape), nullptr);
    wedge.vertices[4] = 0;
    EXPECT_NE(cache.hullOf(wedge.shape), nullptr);
}
}  // namespace cullet::test
