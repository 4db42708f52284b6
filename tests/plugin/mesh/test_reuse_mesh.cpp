// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/prepared_mesh.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/plugin/mesh/mesh_bench.h"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <memory>
#include <new>
#include <utility>
#include <vector>

/// IsaGjkOptions::reusePose for pairs of a convex shape and a mesh.
namespace cullet::test
{
namespace
{
IsaGjkOptions keepingMeshes(bool activeEdges = false)
{
    IsaGjkOptions options;
    options.reusePose.distance = btScalar(1e-3);
    options.activeEdges = activeEdges;
    return options;
}

const btTransform kGround = btTransform::getIdentity();

btTransform at(double x, double y, double z)
{
    return btTransform(btQuaternion::getIdentity(), vec(x, y, z));
}

/// A level square of 10 m, y = 0, of triangles of half a metre.
struct ReuseMesh : testing::Test
{
    static constexpr int kSide = 21;

    ReuseMesh()
    {
        for (int j = 0; j < kSide; ++j)
        {
            for (int i = 0; i < kSide; ++i)
                vertices.push_back(vec(0.5 * i - 5, 0, 0.5 * j - 5));
        }
        for (int j = 0; j + 1 < kSide; ++j)
        {
            for (int i = 0; i + 1 < kSide; ++i)
            {
                const int corner = j * kSide + i;
                for (const int step : {0, kSide, 1, 1, kSide, kSide + 1})
                    indices.push_back(corner + step);
            }
        }
        arrays = std::make_unique<btTriangleIndexVertexArray>(
            static_cast<int>(indices.size() / 3), indices.data(), 3 * int(sizeof(int)),
            static_cast<int>(vertices.size()), vertices[0].m_floats, int(sizeof(btVector3)));
        shape = std::make_unique<btBvhTriangleMeshShape>(arrays.get(), true);
        bodies.push_back(std::make_unique<btSphereShape>(btScalar(0.4)));
        bodies.push_back(std::make_unique<btBoxShape>(vec(0.4, 0.4, 0.4)));
        bodies.push_back(std::make_unique<btCapsuleShapeX>(btScalar(0.4), btScalar(0.8)));
        auto hull = makeHullShape(boxPoints(0.36, 0.36, 0.36));
        hull->setMargin(btScalar(0.04));
        bodies.push_back(std::move(hull));
    }

    /// The place of a vertex.
    btVector3& vertex(int i, int j) { return vertices[static_cast<std::size_t>(j * kSide + i)]; }

    std::vector<btVector3> vertices;
    std::vector<int> indices;
    std::unique_ptr<btTriangleIndexVertexArray> arrays;
    std::unique_ptr<btBvhTriangleMeshShape> shape;
    std::vector<std::unique_ptr<btConvexShape>> bodies;
    /// With margins of the mesh and, of no sphere, of 4 cm: every body touches.
    const btTransform resting = at(0.13, 0.398, 0.21);
};

/// Steps until the contacts are kept: the second step hashes the triangles.
void settle(MeshBench& pair, const btTransform& where)
{
    for (int i = 0; i < 3; ++i)
        pair.step(where, kGround);
    ASSERT_EQ(pair.isaGjk().stats().reusedTotal, 1u);
}

/// Whether the next step computes the contacts, and they are those of a pair without memory.
bool isComputedAgain(MeshBench& pair, const btTransform& where)
{
    const std::uint64_t before = pair.isaGjk().stats().reusedTotal;
    const btPersistentManifold& manifold = pair.step(where, kGround);
    IsaGjkOptions options = pair.isaGjk().options();
    options.reusePose = {};
    MeshBench fresh(Loop::Ours, *pair.convex().getCollisionShape(), *pair.mesh().getCollisionShape(), false,
                    options);
    const btPersistentManifold& expected = fresh.step(where, kGround);
    bool areSame = manifold.getNumContacts() == expected.getNumContacts();
    for (int i = 0; areSame && i < expected.getNumContacts(); ++i)
    {
        bool isThere = false;
        for (int k = 0; k < manifold.getNumContacts(); ++k)
            isThere = isThere || std::memcmp(manifold.getContactPoint(k).m_localPointA.m_floats,
                                             expected.getContactPoint(i).m_localPointA.m_floats,
                                             3 * sizeof(btScalar)) == 0;
        areSame = isThere;
    }
    return areSame && pair.isaGjk().stats().reusedTotal == before;
}

TEST_F(ReuseMesh, KeepsPointsWhileTheBodyStaysWithinTheDistance)
{
    for (const bool activeEdges : {false, true})
    {
        for (const bool isMeshFirst : {false, true})
        {
            for (const auto& body : bodies)
            {
                SCOPED_TRACE(body->getName());
                MeshBench pair(Loop::Ours, *body, *shape, isMeshFirst, keepingMeshes(activeEdges));
                settle(pair, resting);
                const btPersistentManifold before = pair.manifold();
                const btTransform moved = at(0.1303, 0.3978, 0.21);
                const btPersistentManifold& manifold = pair.step(moved, kGround);
                EXPECT_EQ(pair.isaGjk().stats().reusedTotal, 2u);
                ASSERT_EQ(manifold.getNumContacts(), before.getNumContacts());
                for (int i = 0; i < manifold.getNumContacts(); ++i)
                {
                    const btManifoldPoint &now = manifold.getContactPoint(i),
                                          &then = before.getContactPoint(i);
                    EXPECT_TRUE(now.m_localPointA == then.m_localPointA);
                    EXPECT_TRUE(now.m_positionWorldOnA == moved * now.m_localPointA);
                    EXPECT_TRUE(now.m_normalWorldOnB == then.m_normalWorldOnB);
                    EXPECT_EQ(now.m_index1, then.m_index1);
                    EXPECT_EQ(now.m_index0, then.m_index0);
                    EXPECT_LT(double(now.getDistance()), double(then.getDistance()));
                    EXPECT_EQ(now.getLifeTime(), then.getLifeTime() + 1);
                }
                // From the pose in which the contacts were computed.
                EXPECT_TRUE(isComputedAgain(pair, at(0.1315, 0.398, 0.21)));
            }
        }
    }
}

TEST_F(ReuseMesh, TurnsNormalsWithTheMesh)
{
    const btTransform turn(btQuaternion(vec(0, 0, 1), btScalar(0.7)), vec(1, 2, 3));
    for (const auto& body : bodies)
    {
        MeshBench pair(Loop::Ours, *body, *shape, false, keepingMeshes());
        settle(pair, resting);
        const btPersistentManifold before = pair.manifold();
        const btPersistentManifold& manifold = pair.step(turn * resting, turn * kGround);
        EXPECT_EQ(pair.isaGjk().stats().reusedTotal, 2u);
        ASSERT_GT(manifold.getNumContacts(), 0);
        for (int i = 0; i < manifold.getNumContacts(); ++i)
        {
            const btVector3 turned = turn.getBasis() * before.getContactPoint(i).m_normalWorldOnB;
            EXPECT_NEAR(double((manifold.getContactPoint(i).m_normalWorldOnB - turned).length()), 0, 1e-6);
        }
    }
}

TEST_F(ReuseMesh, SeesAVertexThatWasMovedInPlaceNearTheBody)
{
    for (const auto& body : bodies)
    {
        SCOPED_TRACE(body->getName());
        MeshBench pair(Loop::Ours, *body, *shape, false, keepingMeshes());
        settle(pair, resting);
        // In the box that Bullet's tree has for its triangles, without a refit.
        vertex(10, 10) += vec(0.01, 0, 0);
        EXPECT_TRUE(isComputedAgain(pair, resting));
        vertex(10, 10) -= vec(0.01, 0, 0);
    }
}

TEST_F(ReuseMesh, SeesATriangleThatCameFromElsewhereAfterARefit)
{
    for (const auto& body : bodies)
    {
        SCOPED_TRACE(body->getName());
        MeshBench pair(Loop::Ours, *body, *shape, false, keepingMeshes());
        settle(pair, resting);
        const btVector3 away = vertex(0, 0);
        vertex(0, 0) = vec(0.2, 0.03, 0.2);
        shape->refitTree(vec(-6, -1, -6), vec(6, 1, 6));
        EXPECT_TRUE(isComputedAgain(pair, resting));
        vertex(0, 0) = away;
        shape->partialRefitTree(vec(-6, -1, -6), vec(6, 1, 6));
    }
}

TEST_F(ReuseMesh, KeepsPointsWhenVerticesFarAwayAreMoved)
{
    MeshBench pair(Loop::Ours, *bodies[1], *shape, false, keepingMeshes());
    settle(pair, resting);
    vertex(0, 0).setY(btScalar(0.5));
    pair.step(resting, kGround);
    EXPECT_EQ(pair.isaGjk().stats().reusedTotal, 2u);
}

TEST_F(ReuseMesh, NeedsNoTrianglesOfAPreparedMesh)
{
    for (const auto& body : bodies)
    {
        SCOPED_TRACE(body->getName());
        PreparedMesh prepared = prepare(*shape);
        ASSERT_TRUE(prepared.isPrepared());
        btScaledBvhTriangleMeshShape scaled(shape.get(), vec(1, 1, 1));
        for (btConcaveShape* const mesh :
             {static_cast<btConcaveShape*>(shape.get()), static_cast<btConcaveShape*>(&scaled)})
        {
            MeshBench pair(Loop::Ours, *body, *mesh, false, keepingMeshes());
            pair.step(resting, kGround);
            const std::uint64_t triangles = pair.isaGjk().stats().trianglesTotal;
            pair.step(resting, kGround);
            EXPECT_EQ(pair.isaGjk().stats().reusedTotal, 1u);
            EXPECT_EQ(pair.isaGjk().stats().trianglesTotal, triangles);
        }
        MeshBench pair(Loop::Ours, *body, *shape, false, keepingMeshes());
        pair.step(resting, kGround);
        prepared = PreparedMesh();
        vertex(10, 10) += vec(0.01, 0, 0);
        prepared = prepare(*shape);
        EXPECT_TRUE(isComputedAgain(pair, resting));
        prepared = PreparedMesh();
        vertex(10, 10) -= vec(0.01, 0, 0);
        MeshBench other(Loop::Ours, *body, scaled, false, keepingMeshes());
        prepared = prepare(*shape);
        other.step(resting, kGround);
        scaled.setLocalScaling(vec(0.5, 1, 0.5));
        EXPECT_TRUE(isComputedAgain(other, resting));
    }
}

TEST_F(ReuseMesh, SeesRaisedSamplesOfAHeightField)
{
    std::vector<float> heights(11 * 11, 0.0f);
    btHeightfieldTerrainShape field(11, 11, heights.data(), btScalar(-2), btScalar(2), 1, false);
    for (const auto& body : bodies)
    {
        SCOPED_TRACE(body->getName());
        MeshBench pair(Loop::Ours, *body, field, false, keepingMeshes());
        settle(pair, resting);
        heights[5 * 11 + 5] = 0.02f;
        EXPECT_TRUE(isComputedAgain(pair, resting));
        heights[5 * 11 + 5] = 0;
    }
}

TEST_F(ReuseMesh, SeesChangesOfTheMeshAndOfTheBody)
{
    btTriangleMesh otherTriangles;
    otherTriangles.addTriangle(vec(-5, 0.005, -5), vec(0, 0.005, 5), vec(5, 0.005, -5));
    btBvhTriangleMeshShape other(&otherTriangles, true);
    btBoxShape otherBody(vec(0.3, 0.41, 0.3));
    const std::pair<const char*, std::function<void(MeshBench&)>> changes[] = {
        {"mesh", [&](MeshBench& pair) { pair.mesh().setCollisionShape(&other); }},
        {"margin of mesh", [&](MeshBench&) { shape->setMargin(btScalar(0.03)); }},
        {"body", [&](MeshBench& pair) { pair.convex().setCollisionShape(&otherBody); }},
        {"scale of body",
         [&](MeshBench& pair) { pair.convex().getCollisionShape()->setLocalScaling(vec(0.9, 1.01, 0.9)); }},
        {"scale of mesh", [&](MeshBench&) { shape->setLocalScaling(vec(0.7, 1, 0.7)); }},
        {"manifold", [](MeshBench& pair)
         { pair.dispatcher().clearManifold(pair.dispatcher().getManifoldByIndexInternal(0)); }},
        {"threshold", [](MeshBench& pair)
         { pair.dispatcher().getManifoldByIndexInternal(0)->setContactBreakingThreshold(btScalar(0.03)); }},
    };
    for (const auto& change : changes)
    {
        SCOPED_TRACE(change.first);
        btBoxShape box(vec(0.4, 0.4, 0.4));
        MeshBench pair(Loop::Ours, box, *shape, false, keepingMeshes());
        settle(pair, resting);
        change.second(pair);
        const std::uint64_t before = pair.isaGjk().stats().reusedTotal;
        pair.step(resting, kGround);
        EXPECT_EQ(pair.isaGjk().stats().reusedTotal, before);
        shape->setMargin(btScalar(0.04));
    }
}

TEST_F(ReuseMesh, SeesScalingOfAScaledMesh)
{
    btScaledBvhTriangleMeshShape scaled(shape.get(), vec(1, 1, 1));
    MeshBench pair(Loop::Ours, *bodies[1], scaled, false, keepingMeshes());
    settle(pair, resting);
    scaled.setLocalScaling(vec(0.5, 1, 0.5));
    EXPECT_TRUE(isComputedAgain(pair, resting));
}

TEST_F(ReuseMesh, SeesAnotherMeshAtTheAddressOfADeletedOne)
{
    alignas(16) unsigned char memory[sizeof(btBvhTriangleMeshShape)];
    auto* first = new (memory) btBvhTriangleMeshShape(arrays.get(), true);
    MeshBench pair(Loop::Ours, *bodies[1], *first, false, keepingMeshes());
    settle(pair, resting);
    first->~btBvhTriangleMeshShape();
    btTriangleMesh triangles;
    triangles.addTriangle(vec(-5, 0, -5), vec(0, 0, 5), vec(5, 0, -5));
    auto* second = new (memory) btBvhTriangleMeshShape(&triangles, true);
    EXPECT_TRUE(isComputedAgain(pair, resting));
    second->~btBvhTriangleMeshShape();
}

TEST_F(ReuseMesh, ShowsEveryPointToContactCallbacks)
{
    static int added;
    added = 0;
    MeshBench pair(Loop::Ours, *bodies[1], *shape, false, keepingMeshes());
    pair.convex().setCollisionFlags(pair.convex().getCollisionFlags() |
                                    btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    gContactAddedCallback = [](btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                               const btCollisionObjectWrapper*, int, int) { return ++added > 0; };
    pair.step(resting, kGround);
    const int once = added;
    pair.step(resting, kGround);
    pair.step(resting, kGround);
    gContactAddedCallback = nullptr;
    EXPECT_GT(once, 0);
    EXPECT_EQ(added, 3 * once);
    EXPECT_EQ(pair.isaGjk().stats().reusedTotal, 0u);
}

TEST_F(ReuseMesh, AsksShapesOfTheApplicationInEveryStep)
{
    TriangleSoup soup;
    soup.corners = {vec(-5, 0, -5), vec(0, 0, 5), vec(5, 0, -5)};
    MeshBench pair(Loop::Ours, *bodies[1], soup, false, keepingMeshes());
    settle(pair, resting);
    soup.corners[0].setX(-4);
    EXPECT_TRUE(isComputedAgain(pair, resting));
}
}  // namespace
}  // namespace cullet::test
