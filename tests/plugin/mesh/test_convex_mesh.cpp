// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/convex_mesh_hull.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/plugin/mesh/mesh_bench.h"

#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <random>
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
}  // namespace

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
