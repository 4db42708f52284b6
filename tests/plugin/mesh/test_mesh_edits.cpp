// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/plugin/mesh/mesh_bench.h"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btOptimizedBvh.h>
#include <LinearMath/btAlignedAllocator.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <new>
#include <random>
#include <utility>
#include <vector>

// A pair that has touched for steps sees what the application does to the shapes, in the same step.
namespace cullet::test
{
namespace
{
/// Samples of a side. Bullet refits few triangles only in part, those of one of its subtrees.
constexpr int kSide = 5;

/// A level square of 4 m, with triangles of a metre.
struct LevelMesh
{
    LevelMesh()
    {
        for (int x = 0; x < kSide; ++x)
        {
            for (int z = 0; z < kSide; ++z)
            {
                for (const int coordinate : {x - kSide / 2, 0, z - kSide / 2})
                    vertices.push_back(btScalar(coordinate));
            }
        }
        for (int x = 0; x + 1 < kSide; ++x)
        {
            for (int z = 0; z + 1 < kSide; ++z)
            {
                const int corner = x * kSide + z;
                for (const int offset : {0, 1, kSide, kSide, 1, kSide + 1})
                    indices.push_back(corner + offset);
            }
        }
        interface = std::make_unique<btTriangleIndexVertexArray>(
            static_cast<int>(indices.size() / 3), indices.data(), 3 * int(sizeof(int)),
            static_cast<int>(vertices.size() / 3), vertices.data(), 3 * int(sizeof(btScalar)));
    }

    btScalar& heightAt(int x, int z) { return vertices[static_cast<std::size_t>(3 * (x * kSide + z) + 1)]; }

    /// Raises the four corners of the square at the origin.
    void raise(double height)
    {
        for (const int x : {kSide / 2, kSide / 2 + 1})
        {
            for (const int z : {kSide / 2, kSide / 2 + 1})
                heightAt(x, z) = btScalar(height);
        }
    }

    std::vector<btScalar> vertices;
    std::vector<int> indices;
    std::unique_ptr<btTriangleIndexVertexArray> interface;
};

/// A box of half a metre above the square at the origin.
struct MeshEdits : testing::Test
{
    static btTransform above(double height)
    {
        return btTransform(btQuaternion::getIdentity(), vec(0.5, 0.25 + height, 0.5));
    }

    btBoxShape box{vec(0.25, 0.25, 0.25)};
    LevelMesh level;
    const btTransform ground = btTransform::getIdentity();
};

/// A step of a pair with memory, and of one without.
int contactsOf(MeshBench& pair, const btTransform& at)
{
    MeshBench fresh(Loop::Ours, *pair.convex().getCollisionShape(), *pair.mesh().getCollisionShape());
    // Bullet chooses the threshold by the shapes with which a manifold is made.
    for (MeshBench* const bench : {&pair, &fresh})
        bench->dispatcher().getManifoldByIndexInternal(0)->setContactBreakingThreshold(btScalar(0.02));
    const btPersistentManifold& found = pair.stepFromNothing(at, btTransform::getIdentity());
    EXPECT_TRUE(arePointsEqual(found, fresh.step(at, btTransform::getIdentity())));
    return found.getNumContacts();
}

TEST_F(MeshEdits, AreSeenWhenHeightsOfAFieldChangeInPlace)
{
    std::vector<float> heights(kSide * kSide, 0.0f);
    btHeightfieldTerrainShape field(kSide, kSide, heights.data(), btScalar(-2), btScalar(2), 1, false);
    MeshBench pair(Loop::Ours, box, field);
    EXPECT_EQ(contactsOf(pair, above(0.0)), 4);
    EXPECT_EQ(contactsOf(pair, above(0.3)), 0);
    for (const int x : {kSide / 2, kSide / 2 + 1})
    {
        for (const int z : {kSide / 2, kSide / 2 + 1})
            heights[static_cast<std::size_t>(z * kSide + x)] = 0.3f;
    }
    EXPECT_EQ(contactsOf(pair, above(0.3)), 4);
    for (float& height : heights)
        height = -1;
    EXPECT_EQ(contactsOf(pair, above(0.0)), 0);
}

/// Bullet finds a triangle where its tree says that it is, and so does cullet.
TEST_F(MeshEdits, AreSeenWhenTreeIsRefitted)
{
    btBvhTriangleMeshShape shape(level.interface.get(), true, vec(-9, -3, -9), vec(9, 3, 9));
    MeshBench pair(Loop::Ours, box, shape);
    EXPECT_EQ(contactsOf(pair, above(0.0)), 4);
    level.raise(1);
    EXPECT_EQ(contactsOf(pair, above(0.0)), 0) << "the triangles are above the body, read afresh";
    EXPECT_EQ(contactsOf(pair, above(1.0)), 0) << "outside of the tree's boxes, as in Bullet";
    shape.partialRefitTree(vec(-2, -2, -2), vec(2, 2, 2));
    EXPECT_EQ(contactsOf(pair, above(1.0)), 4);
    level.raise(2);
    shape.refitTree(vec(-9, -3, -9), vec(9, 3, 9));
    EXPECT_EQ(contactsOf(pair, above(2.0)), 4);
    EXPECT_EQ(contactsOf(pair, above(1.0)), 0);
}

TEST_F(MeshEdits, AreSeenWhenShapeGetsAnotherTree)
{
    btBvhTriangleMeshShape shape(level.interface.get(), true);
    MeshBench pair(Loop::Ours, box, shape);
    EXPECT_EQ(contactsOf(pair, above(0.0)), 4);
    level.raise(1);
    shape.buildOptimizedBvh();
    EXPECT_EQ(contactsOf(pair, above(1.0)), 4);

    level.raise(0);
    btBvhTriangleMeshShape other(level.interface.get(), true);
    btOptimizedBvh* const former = shape.getOptimizedBvh();
    shape.setOptimizedBvh(other.getOptimizedBvh());
    // The shape has forgotten that it owns it.
    former->~btOptimizedBvh();
    btAlignedFree(former);
    EXPECT_EQ(contactsOf(pair, above(0.0)), 4);
    EXPECT_EQ(contactsOf(pair, above(1.0)), 0);
}

TEST_F(MeshEdits, AreSeenInATreeFromAFile)
{
    btBvhTriangleMeshShape built(level.interface.get(), true);
    const unsigned size = built.getOptimizedBvh()->calculateSerializeBufferSize();
    void* const bytes = btAlignedAlloc(size, 16);
    ASSERT_TRUE(built.getOptimizedBvh()->serializeInPlace(bytes, size, false));
    btOptimizedBvh* const read = btOptimizedBvh::deSerializeInPlace(bytes, size, false);
    ASSERT_NE(read, nullptr);
    {
        btBvhTriangleMeshShape shape(level.interface.get(), true, false);
        shape.setOptimizedBvh(read);
        MeshBench pair(Loop::Ours, box, shape), whole(Loop::Ours, box, built);
        EXPECT_EQ(contactsOf(pair, above(0.0)), 4);
        EXPECT_TRUE(arePointsEqual(pair.manifold(), whole.step(above(0.0), ground)));
    }
    // Its class, whatever Bullet's declaration says.
    static_cast<btQuantizedBvh*>(read)->~btQuantizedBvh();
    btAlignedFree(bytes);
}

/// A shape that is deleted, and another of the same class at its address: the pair lives on until the next step.
template <class Shape>
struct Replaceable
{
    template <class... Arguments>
    Shape& make(Arguments&&... arguments)
    {
        end();
        shape = new (place) Shape(std::forward<Arguments>(arguments)...);
        return *shape;
    }
    void end()
    {
        if (shape != nullptr)
            shape->~Shape();
        shape = nullptr;
        // Whatever is read of a shape that has ended is seen.
        std::fill_n(place, sizeof(place), static_cast<unsigned char>(0xA5));
    }
    ~Replaceable() { end(); }

    alignas(16) unsigned char place[sizeof(Shape)];
    Shape* shape = nullptr;
};

TEST_F(MeshEdits, AreSeenWhenAnotherBodyIsAtTheAddressOfADeletedOne)
{
    btBvhTriangleMeshShape shape(level.interface.get(), true);
    std::mt19937 engine(32);
    std::uniform_real_distribution<double> place(-0.25, 0.25);
    std::vector<btVector3> small;
    for (int i = 0; i < 30; ++i)
        small.push_back(drawVec(place, engine));
    std::vector<btVector3> large;
    for (const btVector3& point : small)
        large.push_back(point * btScalar(2));
    Replaceable<btConvexHullShape> hull;
    hull.make(&small[0].m_floats[0], 30, int(sizeof(btVector3)));
    MeshBench pair(Loop::Ours, *hull.shape, shape);
    int touching = 0;
    for (int i = 0; i < 20; ++i)
    {
        const bool isLarge = i % 2 == 1;
        hull.make(&(isLarge ? large : small)[0].m_floats[0], 30, int(sizeof(btVector3)));
        const int contacts = contactsOf(pair, above(0.15));
        touching += contacts > 0 ? 1 : 0;
        EXPECT_EQ(contacts > 0, isLarge) << i;
    }
    EXPECT_EQ(touching, 10);
}

TEST_F(MeshEdits, AreSeenWhenAnotherMeshIsAtTheAddressOfADeletedOne)
{
    LevelMesh raised;
    for (btScalar& coordinate : raised.vertices)
        coordinate += btScalar(1);
    Replaceable<btBvhTriangleMeshShape> mesh;
    mesh.make(level.interface.get(), true);
    MeshBench pair(Loop::Ours, box, *mesh.shape);
    for (int i = 0; i < 6; ++i)
    {
        const bool isRaised = i % 2 == 1;
        mesh.make(isRaised ? raised.interface.get() : level.interface.get(), true);
        EXPECT_EQ(contactsOf(pair, above(1.0)) > 0, isRaised) << i;
        EXPECT_EQ(contactsOf(pair, above(0.0)) > 0, !isRaised) << i;
    }
}

/// Pairs outlive shapes until the next step: nothing reads them meanwhile, nor when the pair is removed.
TEST_F(MeshEdits, MayDeleteShapesBeforeTheirPair)
{
    auto shape = std::make_unique<btBvhTriangleMeshShape>(level.interface.get(), true);
    auto body = std::make_unique<btBoxShape>(vec(0.25, 0.25, 0.25));
    auto pair = std::make_unique<MeshBench>(Loop::Ours, *body, *shape);
    EXPECT_EQ(pair->step(above(0.0), ground).getNumContacts(), 4);
    body.reset();
    shape.reset();
    EXPECT_EQ(pair->dispatcher().getNumManifolds(), 1);
    pair.reset();
}
}  // namespace
}  // namespace cullet::test
