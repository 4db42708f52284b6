// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/triangle_source.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/convex/convex_world.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
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

/// Compares with what the shape itself names, bit by bit and in order.
///
/// @return the number of triangles
std::size_t expectSame(const btConcaveShape& shape, std::mt19937& engine)
{
    std::uniform_real_distribution<double> place(-6, 6);
    std::size_t total = 0;
    for (int i = 0; i < 50; ++i)
    {
        const btVector3 a = drawVec(place, engine), b = drawVec(place, engine);
        btVector3 low = a, high = a;
        low.setMin(b);
        high.setMax(b);
        Reader ours, own;
        forEachTriangle(shape, ours, low, high);
        shape.processAllTriangles(&own, low, high);
        EXPECT_EQ(ours.triangles.size(), own.triangles.size());
        for (std::size_t k = 0; k < std::min(ours.triangles.size(), own.triangles.size()); ++k)
        {
            const Named &x = ours.triangles[k], &y = own.triangles[k];
            EXPECT_EQ(x.part, y.part);
            EXPECT_EQ(x.index, y.index);
            for (int c = 0; c < 3; ++c)
                EXPECT_EQ(std::memcmp(x.corners[c].m_floats, y.corners[c].m_floats, 3 * sizeof(btScalar)), 0);
        }
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
}  // namespace
}  // namespace cullet::test
