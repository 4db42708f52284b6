// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/broadphase.h"
#include "cullet/tests/support/random.h"

#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <btBulletCollisionCommon.h>

#include <array>
#include <cstdint>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

namespace cullet::test
{
inline btVector3 randomVector(Random& random, float extent)
{
    const std::array<float, 3> point = random.point(-extent, extent);
    return {point[0], point[1], point[2]};
}

/// A pose with any rotation.
inline btTransform randomPose(Random& random, float extent)
{
    btVector3 axis = randomVector(random, 1.0f);
    axis += btVector3(btScalar(1e-3), 0, 0);
    const btScalar angle = random.between(0.0f, 6.0f);
    return btTransform(btQuaternion(axis.normalized(), angle), randomVector(random, extent));
}

/// The arrays of a mesh of 10 m around the origin.
struct MeshData
{
    std::vector<btScalar> vertices;
    std::vector<int> indices;

    void add(const btVector3& vertex)
    {
        for (int axis = 0; axis < 3; ++axis)
            vertices.push_back(vertex[axis]);
    }
    int triangleCount() const { return static_cast<int>(indices.size() / 3); }
};

/// @param kind terrain: hills; flat: level, with an edge every half metre; soup: random triangles; sizes: of all sizes;
///             needles: long and thin
inline MeshData makeMeshData(const std::string& kind, std::uint32_t seed)
{
    Random random(seed);
    MeshData data;
    if (kind == "terrain" || kind == "flat")
    {
        constexpr int kCells = 40;
        for (int z = 0; z <= kCells; ++z)
        {
            for (int x = 0; x <= kCells; ++x)
            {
                const btScalar height = kind == "flat" ? btScalar(0) : btScalar(random.between(-0.5f, 0.5f));
                data.add(
                    btVector3(btScalar(0.5) * btScalar(x) - 10, height, btScalar(0.5) * btScalar(z) - 10));
            }
        }
        for (int z = 0; z < kCells; ++z)
        {
            for (int x = 0; x < kCells; ++x)
            {
                const int corner = z * (kCells + 1) + x;
                for (const int offset : {0, kCells + 1, 1, 1, kCells + 1, kCells + 2})
                    data.indices.push_back(corner + offset);
            }
        }
        return data;
    }
    for (int i = 0; i < 2000; ++i)
    {
        const btVector3 centre = randomVector(random, 10.0f);
        const float size = kind == "sizes" ? random.logUniform(-9, 4) : 1.0f;
        for (int corner = 0; corner < 3; ++corner)
        {
            data.indices.push_back(static_cast<int>(data.vertices.size() / 3));
            const btVector3 offset = randomVector(random, size);
            data.add(kind == "needles" && corner == 2 ? centre + offset * btScalar(0.01) : centre + offset);
        }
    }
    return data;
}

/// A world with one mesh.
class QueryWorld
{
public:
    QueryWorld(MeshData data, bool isQuantized, const btVector3& scaling = btVector3(1, 1, 1))
        : m_data(std::move(data)),
          m_interface(m_data.triangleCount(), m_data.indices.data(), 3 * sizeof(int),
                      static_cast<int>(m_data.vertices.size() / 3), m_data.vertices.data(),
                      3 * sizeof(btScalar)),
          shape(&m_interface, isQuantized),
          m_scaled(&shape, scaling),
          m_dispatcher(&m_configuration),
          world(&m_dispatcher, &m_broadphase, &m_configuration)
    {
        const bool isScaled = scaling != btVector3(1, 1, 1);
        object.setCollisionShape(isScaled ? static_cast<btCollisionShape*>(&m_scaled) : &shape);
        world.addCollisionObject(&object);
    }
    ~QueryWorld() { world.removeCollisionObject(&object); }

    void place(const btTransform& pose)
    {
        object.setWorldTransform(pose);
        world.updateSingleAabb(&object);
    }

    const MeshData& data() const { return m_data; }

private:
    MeshData m_data;
    btTriangleIndexVertexArray m_interface;

public:
    btBvhTriangleMeshShape shape;

private:
    btScaledBvhTriangleMeshShape m_scaled;
    btDefaultCollisionConfiguration m_configuration;
    btCollisionDispatcher m_dispatcher;
    Broadphase m_broadphase;

public:
    btCollisionWorld world;
    btCollisionObject object;
};

/// A mesh, Bullet's tree over it and its scale.
struct MeshCase
{
    std::string kind;
    bool isQuantized;
    btVector3 scaling;

    std::string name() const
    {
        return kind + (isQuantized ? "Quantized" : "Plain") +
               (scaling == btVector3(1, 1, 1) ? ""
                : scaling.x() < 0             ? "Mirrored"
                                              : "Scaled");
    }
};

/// For the messages of tests.
inline std::ostream& operator<<(std::ostream& stream, const MeshCase& tested)
{
    return stream << tested.name();
}

inline std::vector<MeshCase> meshCases()
{
    const btVector3 one(1, 1, 1);
    std::vector<MeshCase> cases;
    for (const char* const kind : {"terrain", "flat", "soup", "sizes", "needles"})
    {
        cases.push_back({kind, true, one});
        cases.push_back({kind, false, one});
    }
    cases.push_back({"terrain", true, btVector3(2, 3, btScalar(0.5))});
    cases.push_back({"terrain", false, btVector3(-1, 2, btScalar(1.5))});
    return cases;
}
}  // namespace cullet::test
