// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/prepared_mesh.h"
#include "cullet/plugin/queries/mesh_queries.h"
#include "cullet/plugin/queries/mesh_registry.h"
#include "cullet/plugin/world_queries.h"
#include "cullet/tests/plugin/queries/query_mesh.h"

#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <gtest/gtest.h>

#include <new>
#include <optional>
#include <utility>

namespace cullet::test
{
namespace
{
/// The vertices are the caller's.
btTriangleIndexVertexArray interfaceOf(MeshData& data)
{
    return {data.triangleCount(), data.indices.data(),
            3 * sizeof(int),      static_cast<int>(data.vertices.size() / 3),
            data.vertices.data(), 3 * sizeof(btScalar)};
}

bool isUsed(const btBvhTriangleMeshShape& shape)
{
    return MeshRegistry::shared().find(shape) != nullptr;
}

TEST(PreparedMesh, IsUsedWhileItLives)
{
    MeshData data = makeMeshData("terrain", 1);
    btTriangleIndexVertexArray interface = interfaceOf(data);
    const btBvhTriangleMeshShape shape(&interface, true);
    EXPECT_FALSE(isUsed(shape));
    {
        PreparedMesh prepared = prepare(shape);
        EXPECT_TRUE(prepared.isPrepared());
        EXPECT_TRUE(isUsed(shape));
        const PreparedMesh moved = std::move(prepared);
        EXPECT_FALSE(prepared.isPrepared());
        EXPECT_TRUE(isUsed(shape));
        prepared = PreparedMesh();
        EXPECT_TRUE(isUsed(shape));
    }
    EXPECT_FALSE(isUsed(shape));
}

TEST(PreparedMesh, IsUsedUntilLastOfTwoEnds)
{
    MeshData data = makeMeshData("terrain", 1);
    btTriangleIndexVertexArray interface = interfaceOf(data);
    const btBvhTriangleMeshShape shape(&interface, true);
    PreparedMesh first = prepare(shape);
    const PreparedMesh second = prepare(shape);
    first = PreparedMesh();
    EXPECT_TRUE(isUsed(shape));
}

TEST(PreparedMesh, LeavesOtherClassesToBullet)
{
    struct Derived : btBvhTriangleMeshShape
    {
        using btBvhTriangleMeshShape::btBvhTriangleMeshShape;
        const char* getName() const override { return "derived"; }
    };
    struct DerivedInterface : btTriangleIndexVertexArray
    {
        int getNumSubParts() const override { return btTriangleIndexVertexArray::getNumSubParts(); }
    };
    MeshData data = makeMeshData("terrain", 1);
    btTriangleIndexVertexArray interface = interfaceOf(data);
    DerivedInterface other;
    other.addIndexedMesh(interface.getIndexedMeshArray()[0]);
    const Derived derived(&interface, true);
    struct DerivedMaterial : btMultimaterialTriangleMeshShape
    {
        using btMultimaterialTriangleMeshShape::btMultimaterialTriangleMeshShape;
        const char* getName() const override { return "derived"; }
    };
    const DerivedMaterial material(&interface, true);
    const btBvhTriangleMeshShape withoutTree(&interface, true, false);
    const btBvhTriangleMeshShape onOther(&other, true);
    const btBvhTriangleMeshShape* const shapes[] = {&derived, &material, &withoutTree, &onOther};
    for (const btBvhTriangleMeshShape* shape : shapes)
    {
        const PreparedMesh prepared = prepare(*shape);
        EXPECT_FALSE(prepared.isPrepared());
        EXPECT_EQ(prepared.bytes(), 0u);
        EXPECT_FALSE(isUsed(*shape));
    }
}

TEST(PreparedMesh, TakesAtMost40BytesPerTriangle)
{
    MeshData data = makeMeshData("terrain", 1);
    btTriangleIndexVertexArray interface = interfaceOf(data);
    const btBvhTriangleMeshShape shape(&interface, true);
    const PreparedMesh prepared = prepare(shape);
    EXPECT_LE(prepared.bytes(),
              40u * static_cast<unsigned>(data.triangleCount()) + sizeof(MeshQueries) + 100u);
}

/// A shape at an address at which another one was prepared, whose handle lives on.
class ReplacedShape : public testing::Test
{
protected:
    ReplacedShape() : data(makeMeshData("terrain", 1)), interface(interfaceOf(data))
    {
        shape = new (place) btBvhTriangleMeshShape(&interface, true);
        prepared = prepare(*shape);
    }
    ~ReplacedShape() override { shape->~btBvhTriangleMeshShape(); }

    void end() { shape->~btBvhTriangleMeshShape(); }

    MeshData data;
    btTriangleIndexVertexArray interface;
    alignas(16) unsigned char place[sizeof(btBvhTriangleMeshShape)];
    btBvhTriangleMeshShape* shape;
    PreparedMesh prepared;
};

TEST_F(ReplacedShape, IsLeftToBulletWhenMeshInterfaceDiffers)
{
    ASSERT_TRUE(isUsed(*shape));
    MeshData other = makeMeshData("terrain", 2);
    btTriangleIndexVertexArray otherInterface = interfaceOf(other);
    end();
    shape = new (place) btBvhTriangleMeshShape(&otherInterface, true);
    EXPECT_FALSE(isUsed(*shape));
    end();
    shape = new (place) btBvhTriangleMeshShape(&interface, true);
}

TEST_F(ReplacedShape, IsLeftToBulletWhenVerticesDifferInPlace)
{
    end();
    for (std::size_t i = 1; i < data.vertices.size(); i += 3)
        data.vertices[i] *= btScalar(0.5);
    shape = new (place) btBvhTriangleMeshShape(&interface, true);
    EXPECT_FALSE(isUsed(*shape));
}

TEST_F(ReplacedShape, IsLeftToBulletWhenCornerOfFirstTriangleMoves)
{
    data.vertices[static_cast<std::size_t>(3 * data.indices[0] + 1)] *= btScalar(0.9);
    EXPECT_FALSE(isUsed(*shape));
}

TEST_F(ReplacedShape, IsLeftToBulletWhenQuantizationDiffers)
{
    end();
    shape = new (place) btBvhTriangleMeshShape(&interface, false);
    EXPECT_FALSE(isUsed(*shape));
}

TEST_F(ReplacedShape, IsLeftToBulletWhenScalingChanges)
{
    shape->setLocalScaling(btVector3(1, 2, 1));
    EXPECT_FALSE(isUsed(*shape));
}

TEST_F(ReplacedShape, IsLeftToBulletWhenArraysChange)
{
    MeshData other = data;
    btIndexedMesh& part = interface.getIndexedMeshArray()[0];
    const btIndexedMesh before = part;
    part.m_vertexBase = reinterpret_cast<const unsigned char*>(other.vertices.data());
    EXPECT_FALSE(isUsed(*shape));
    part = before;
    EXPECT_TRUE(isUsed(*shape));
    part.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(other.indices.data());
    EXPECT_FALSE(isUsed(*shape));
    part = before;
    --part.m_numTriangles;
    EXPECT_FALSE(isUsed(*shape));
    part = before;
}

TEST(MeshRegistry, FindsEachOfManyMeshes)
{
    MeshData data = makeMeshData("terrain", 1);
    btTriangleIndexVertexArray interface = interfaceOf(data);
    std::vector<std::unique_ptr<btBvhTriangleMeshShape>> shapes;
    std::vector<PreparedMesh> prepared;
    for (int i = 0; i < 50; ++i)
    {
        shapes.push_back(std::make_unique<btBvhTriangleMeshShape>(&interface, true));
        prepared.push_back(prepare(*shapes.back()));
    }
    for (std::size_t i = 0; i < shapes.size(); i += 2)
        prepared[i] = PreparedMesh();
    for (std::size_t i = 0; i < shapes.size(); ++i)
        EXPECT_EQ(isUsed(*shapes[i]), i % 2 == 1) << i;
}

/// Types of coordinates and indices of a part.
struct Types
{
    PHY_ScalarType vertex, index;
};

/// The arrays of a square of two triangles at a height, of any types; with gaps between them.
class TypedSquare
{
public:
    TypedSquare(Types types, double height)
    {
        const double corners[4][3] = {{-1, height, -1}, {1, height, -1}, {-1, height, 1}, {1, height, 1}};
        for (const auto& corner : corners)
        {
            for (const double coordinate : corner)
                append(m_vertices, types.vertex, coordinate);
            append(m_vertices, types.vertex, 99);
        }
        for (const int index : {0, 2, 1, 1, 2, 3})
        {
            append(m_indices, types.index, index);
            if (index == 1 && m_indices.size() == 3 * sizeOf(types.index))
                append(m_indices, types.index, 77);
        }
        part.m_numTriangles = 2;
        part.m_numVertices = 4;
        part.m_vertexBase = m_vertices.data();
        part.m_vertexStride = static_cast<int>(4 * sizeOf(types.vertex));
        part.m_triangleIndexBase = m_indices.data();
        part.m_triangleIndexStride = static_cast<int>(4 * sizeOf(types.index));
        part.m_vertexType = types.vertex;
    }

    btIndexedMesh part;

private:
    static std::size_t sizeOf(PHY_ScalarType type)
    {
        return type == PHY_DOUBLE ? 8 : type == PHY_SHORT ? 2 : type == PHY_UCHAR ? 1 : 4;
    }

    template <class T>
    static void appendAs(std::vector<unsigned char>& bytes, T value)
    {
        const auto* const first = reinterpret_cast<const unsigned char*>(&value);
        bytes.insert(bytes.end(), first, first + sizeof(value));
    }

    static void append(std::vector<unsigned char>& bytes, PHY_ScalarType type, double value)
    {
        if (type == PHY_DOUBLE)
            appendAs(bytes, value);
        else if (type == PHY_FLOAT)
            appendAs(bytes, static_cast<float>(value));
        else if (type == PHY_INTEGER)
            appendAs(bytes, static_cast<int>(value));
        else if (type == PHY_SHORT)
            appendAs(bytes, static_cast<unsigned short>(value));
        else
            appendAs(bytes, static_cast<unsigned char>(value));
    }

    std::vector<unsigned char> m_vertices, m_indices;
};

TEST(PreparedMesh, ReadsArraysOfAllTypesInParts)
{
    std::vector<std::unique_ptr<TypedSquare>> squares;
    btTriangleIndexVertexArray interface;
    for (const PHY_ScalarType vertex : {PHY_FLOAT, PHY_DOUBLE})
    {
        for (const PHY_ScalarType index : {PHY_INTEGER, PHY_SHORT, PHY_UCHAR})
        {
            squares.push_back(
                std::make_unique<TypedSquare>(Types{vertex, index}, 1.0 + 1.1 * double(squares.size())));
            interface.addIndexedMesh(squares.back()->part, index);
        }
    }
    interface.setScaling(btVector3(btScalar(1.5), 2, btScalar(0.7)));
    const btBvhTriangleMeshShape shape(&interface, true);
    const PreparedMesh prepared = prepare(shape);
    ASSERT_TRUE(prepared.isPrepared());
    const MeshQueries& mesh = *MeshRegistry::shared().find(shape);
    struct Triangles : btTriangleCallback
    {
        void processTriangle(btVector3* corners, int part, int index) override
        {
            btVector3 read[3];
            const TriangleName name = mesh->read(static_cast<std::uint32_t>(2 * part + index), read);
            ++count;
            EXPECT_EQ(name.part, part);
            EXPECT_EQ(name.index, index);
            for (int corner = 0; corner < 3; ++corner)
                EXPECT_EQ(read[corner], corners[corner]) << part << " " << index << " " << corner;
        }
        const MeshQueries* mesh;
        std::uint32_t count = 0;
    } triangles;
    triangles.mesh = &mesh;
    shape.processAllTriangles(&triangles, btVector3(-100, -100, -100), btVector3(100, 100, 100));
    EXPECT_EQ(triangles.count, 12u);
}
}  // namespace
}  // namespace cullet::test
