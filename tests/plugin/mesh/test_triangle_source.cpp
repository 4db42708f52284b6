// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/mesh_region.h"
#include "cullet/plugin/mesh/triangle_source.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/convex/convex_world.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <vector>

namespace cullet::test
{
namespace
{
struct Named
{
    btVector3 corners[3];
    int part, index;
};

struct Reader : btTriangleCallback
{
    void processTriangle(btVector3* corners, int part, int index) override
    {
        triangles.push_back({{corners[0], corners[1], corners[2]}, part, index});
    }
    std::vector<Named> triangles;
};

struct Box
{
    btVector3 low, high;
};

Box drawBox(double reach, std::mt19937& engine)
{
    std::uniform_real_distribution<double> place(-reach, reach);
    const btVector3 a = drawVec(place, engine), b = drawVec(place, engine);
    Box box = {a, a};
    box.low.setMin(b);
    box.high.setMax(b);
    return box;
}

/// Compares bit by bit and in order.
void expectSame(const std::vector<Named>& ours, const std::vector<Named>& own)
{
    EXPECT_EQ(ours.size(), own.size());
    for (std::size_t k = 0; k < std::min(ours.size(), own.size()); ++k)
    {
        const Named &x = ours[k], &y = own[k];
        EXPECT_EQ(x.part, y.part);
        EXPECT_EQ(x.index, y.index);
        for (int c = 0; c < 3; ++c)
            EXPECT_EQ(std::memcmp(x.corners[c].m_floats, y.corners[c].m_floats, 3 * sizeof(btScalar)), 0);
    }
}

/// Compares with what the shape itself names.
///
/// @return the number of triangles
std::size_t expectSame(const btConcaveShape& shape, std::mt19937& engine)
{
    std::size_t total = 0;
    for (int i = 0; i < 50; ++i)
    {
        const Box box = drawBox(6, engine);
        Reader ours, own;
        forEachTriangle(shape, ours, box.low, box.high);
        shape.processAllTriangles(&own, box.low, box.high);
        expectSame(ours.triangles, own.triangles);
        total += own.triangles.size();
    }
    return total;
}

/// Vertices and indices of one part, as an application has them.
template <class Number, class Index>
struct Arrays
{
    explicit Arrays(std::mt19937& engine)
    {
        std::uniform_real_distribution<double> place(-5, 5);
        std::uniform_int_distribution<int> vertex(0, 119);
        for (int i = 0; i < 4 * 120; ++i)
            vertices.push_back(Number(place(engine)));
        for (int i = 0; i < 3 * 300; ++i)
            indices.push_back(Index(vertex(engine)));
    }
    /// Small triangles, each with corners of its own.
    ///
    /// @param size of a triangle at most
    Arrays(std::mt19937& engine, double size)
    {
        std::uniform_real_distribution<double> place(-5, 5), way(-size, size);
        for (int i = 0; i < 900; ++i)
        {
            if (i % 3 == 0)
                m_middle = drawVec(place, engine);
            const btVector3 corner = m_middle + drawVec(way, engine);
            vertices.insert(vertices.end(), {Number(corner.x()), Number(corner.y()), Number(corner.z()), 0});
            indices.push_back(Index(i));
        }
    }

    /// Vertices of four numbers, of which the last is not a coordinate.
    void addTo(btTriangleIndexVertexArray& mesh, PHY_ScalarType number, PHY_ScalarType index)
    {
        btIndexedMesh part;
        part.m_numTriangles = static_cast<int>(indices.size() / 3);
        part.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(indices.data());
        part.m_triangleIndexStride = static_cast<int>(3 * sizeof(Index));
        part.m_numVertices = static_cast<int>(vertices.size() / 4);
        part.m_vertexBase = reinterpret_cast<const unsigned char*>(vertices.data());
        part.m_vertexStride = static_cast<int>(4 * sizeof(Number));
        part.m_vertexType = number;
        mesh.addIndexedMesh(part, index);
        mesh.getIndexedMeshArray()[mesh.getNumSubParts() - 1].m_vertexType = number;
    }

    std::vector<Number> vertices;
    std::vector<Index> indices;

private:
    btVector3 m_middle = btVector3(0, 0, 0);
};

TEST(TriangleSource, NamesTrianglesOfAllKindsOfArraysAsTheShape)
{
    constexpr unsigned kSeed = 3;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    Arrays<float, int> first(engine);
    Arrays<double, std::uint16_t> second(engine);
    Arrays<float, std::uint8_t> third(engine);
    btTriangleIndexVertexArray mesh;
    first.addTo(mesh, PHY_FLOAT, PHY_INTEGER);
    second.addTo(mesh, PHY_DOUBLE, PHY_SHORT);
    third.addTo(mesh, PHY_FLOAT, PHY_UCHAR);
    for (const bool isQuantized : {true, false})
    {
        btBvhTriangleMeshShape shape(&mesh, isQuantized);
        EXPECT_GT(expectSame(shape, engine), 1000u);
        btScaledBvhTriangleMeshShape scaled(&shape, vec(1.5, -2, 0.7));
        EXPECT_GT(expectSame(scaled, engine), 1000u);
    }
    btMultimaterialTriangleMeshShape materials(&mesh, true);
    EXPECT_GT(expectSame(materials, engine), 1000u);
    mesh.setScaling(vec(0.5, 1, 2));
    btBvhTriangleMeshShape stretched(&mesh, true);
    EXPECT_GT(expectSame(stretched, engine), 1000u);
    btBvhTriangleMeshShape withoutTree(&mesh, true, false);
    EXPECT_EQ(withoutTree.getOptimizedBvh(), nullptr);
}

/// Names one triangle, whatever its tree contains.
struct OwnShape : btBvhTriangleMeshShape
{
    using btBvhTriangleMeshShape::btBvhTriangleMeshShape;
    void processAllTriangles(btTriangleCallback* callback, const btVector3&, const btVector3&) const override
    {
        btVector3 corners[3] = {vec(0, 0, 0), vec(1, 0, 0), vec(0, 1, 0)};
        callback->processTriangle(corners, 7, 9);
    }
};

TEST(TriangleSource, AsksShapesOfTheApplicationThemselves)
{
    std::mt19937 engine(4);
    btTriangleMesh mesh;
    mesh.addTriangle(vec(-1, 0, 0), vec(1, 0, 0), vec(0, 0, 1));
    OwnShape own(&mesh, true);
    EXPECT_EQ(expectSame(own, engine), 50u);
    btScaledBvhTriangleMeshShape scaled(&own, vec(2, 2, 2));
    EXPECT_EQ(expectSame(scaled, engine), 50u);
}

/// What a region has answered.
struct RegionCounts
{
    std::size_t triangles = 0, without = 0;
};

/// Compares regions with the shape, for boxes in them.
RegionCounts expectSameInRegions(btBvhTriangleMeshShape& shape, std::mt19937& engine)
{
    RegionCounts counts;
    MeshRegion region;
    for (int i = 0; i < 30; ++i)
    {
        const Box outer = drawBox(7, engine);
        region.find(shape, outer.low, outer.high, 100000);
        EXPECT_TRUE(region.covers(outer.low, outer.high));
        for (int k = 0; k < 20; ++k)
        {
            Box box = drawBox(k % 4 == 0 ? 7 : 1, engine);
            box.low.setMax(outer.low);
            box.high.setMin(outer.high);
            box.low.setMin(box.high);
            if (!region.covers(box.low, box.high))
                continue;
            Reader ours, own;
            region.forEachTriangle(ours, box.low, box.high);
            shape.processAllTriangles(&own, box.low, box.high);
            expectSame(ours.triangles, own.triangles);
            EXPECT_EQ(region.hasTriangles(box.low, box.high), !own.triangles.empty());
            counts.triangles += own.triangles.size();
            counts.without += own.triangles.empty() ? 1 : 0;
        }
    }
    return counts;
}

TEST(LastFrame, HasBitsOfNewFrameForEqualAndOtherBases)
{
    std::mt19937 engine(3);
    std::uniform_real_distribution<btScalar> number(-3, 3);
    const auto somewhere = [&]
    {
        const btScalar x = number(engine), y = number(engine), z = number(engine);
        return btVector3(x, y, z);
    };
    LastFrame last;
    btTransform core(btTransform::getIdentity()), mesh(btTransform::getIdentity());
    for (int i = 0; i < 300; ++i)
    {
        // Of six steps, four have the bases of the one before.
        if (i % 6 == 0)
            core.setRotation(btQuaternion(somewhere().normalized(), number(engine)));
        if (i % 6 == 3)
            mesh.setRotation(btQuaternion(somewhere().normalized(), number(engine)));
        core.setOrigin(somewhere());
        mesh.setOrigin(somewhere());
        const CoreFrame kept = last.frameOf(core, mesh), made(core, mesh, FrameAxes::Core);
        ASSERT_TRUE(kept.isUsable());
        EXPECT_EQ(kept.meshBasis(), made.meshBasis()) << i;
        EXPECT_EQ(kept.meshOrigin(), made.meshOrigin()) << i;
        EXPECT_EQ(kept.coreBasis(), made.coreBasis()) << i;
        const btVector3 point = somewhere();
        EXPECT_EQ(kept.ofWorld(point), made.ofWorld(point)) << i;
    }
    core.setOrigin(btVector3(std::numeric_limits<btScalar>::quiet_NaN(), 0, 0));
    EXPECT_FALSE(last.frameOf(core, mesh).isUsable());
}

TEST(MeshRegion, NamesTrianglesOfSmallerBoxesAsTheShape)
{
    constexpr unsigned kSeed = 5;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    Arrays<float, int> first(engine, 0.4);
    Arrays<double, std::uint16_t> second(engine, 0.4);
    btTriangleIndexVertexArray mesh;
    first.addTo(mesh, PHY_FLOAT, PHY_INTEGER);
    second.addTo(mesh, PHY_DOUBLE, PHY_SHORT);
    btBvhTriangleMeshShape quantized(&mesh, true), plain(&mesh, false);
    btMultimaterialTriangleMeshShape materials(&mesh, true);
    for (btBvhTriangleMeshShape* const shape :
         {&quantized, &plain, static_cast<btBvhTriangleMeshShape*>(&materials)})
    {
        const RegionCounts counts = expectSameInRegions(*shape, engine);
        EXPECT_GT(counts.triangles, 500u);
        EXPECT_GT(counts.without, 20u);
    }
    // Vertices may change, and the tree with them, between two searches.
    for (float& coordinate : first.vertices)
        coordinate *= 0.5f;
    quantized.refitTree(vec(-5, -5, -5), vec(5, 5, 5));
    EXPECT_GT(expectSameInRegions(quantized, engine).triangles, 500u);
}

TEST(MeshRegion, CoversNothingThatItHasNotFound)
{
    std::mt19937 engine(6);
    Arrays<float, int> arrays(engine);
    btTriangleIndexVertexArray mesh;
    arrays.addTo(mesh, PHY_FLOAT, PHY_INTEGER);
    const btVector3 low = vec(-2, -2, -2), high = vec(2, 2, 2);
    btBvhTriangleMeshShape shape(&mesh, true), withoutTree(&mesh, true, false);
    MeshRegion region;
    EXPECT_FALSE(region.covers(low, high));
    region.find(shape, low, high, 1000);
    EXPECT_TRUE(region.covers(low, high));
    EXPECT_FALSE(region.covers(low, vec(2, 2.1, 2)));
    EXPECT_FALSE(region.covers(low, vec(2, std::numeric_limits<double>::quiet_NaN(), 2)));
    region.find(shape, low, high, 10);
    EXPECT_FALSE(region.covers(low, high)) << "there are more triangles";
    region.find(withoutTree, low, high, 1000);
    EXPECT_FALSE(region.covers(low, high)) << "there is no tree";
    OwnShape own(&mesh, true);
    region.find(own, low, high, 1000);
    EXPECT_FALSE(region.covers(low, high)) << "the application names the triangles";
    btScaledBvhTriangleMeshShape scaled(&shape, vec(2, 2, 2));
    region.find(scaled, low, high, 1000);
    EXPECT_FALSE(region.covers(low, high)) << "the tree has other coordinates";
    shape.getOptimizedBvh()->setTraversalMode(btQuantizedBvh::TRAVERSAL_RECURSIVE);
    region.find(shape, low, high, 1000);
    EXPECT_FALSE(region.covers(low, high)) << "Bullet reads the tree in another way";
}
}  // namespace
}  // namespace cullet::test
