// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/worlds/convex_mesh_world.h"

#include "cullet/demos/scenes/worlds/lattice_mesh.h"

#include <array>
#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
class ConvexMeshWorld : public WorldScene
{
public:
    ConvexMeshWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene)
    {
        world().setGravity(btVector3(0, btScalar(-9.81), 0));
        addMesh();
        const std::array<Kind, 4> kinds = makeKinds();
        const auto perSide = static_cast<std::uint32_t>(std::ceil(std::sqrt((scene.bodies + 3) / 4)));
        const btScalar centre = btScalar(perSide - 1) / 2;
        for (std::uint32_t i = 0; i < scene.bodies; ++i)
        {
            const std::uint32_t layer = i % 4, site = i / 4;
            const btScalar x = btScalar(site / perSide) - centre, z = btScalar(site % perSide) - centre;
            const btVector3 place(kApart * x, 15 + 2 * btScalar(layer), kApart * z);
            btRigidBody& body = addBody(kinds[layer].shape, kinds[layer].mass, transformAt(place));
            body.setDamping(btScalar(0.05), btScalar(0.05));
            setSurface(body);
        }
    }

private:
    static constexpr int kReach = 50;     ///< cells of the mesh on each side
    static constexpr btScalar kCell = 3;  ///< metres
    static constexpr btScalar kApart = btScalar(7.5);

    struct Kind
    {
        btCollisionShape& shape;
        btScalar mass;
    };

    static void setSurface(btRigidBody& body)
    {
        body.setFriction(btScalar(0.5));
        body.setRestitution(btScalar(0.6));
    }

    static btVector3 cornerAt(int x, int z)
    {
        const btScalar height = btSin(btScalar(x + kReach) / 2) * btCos(btScalar(z + kReach) / 2);
        return btVector3(kCell * btScalar(x), 5 + 5 * height, kCell * btScalar(z));
    }

    void addMesh()
    {
        btTriangleMesh& mesh = makeShape<btTriangleMesh>();
        addLattice(mesh, -kReach, kReach, cornerAt);
        setSurface(addBody(makeShape<btBvhTriangleMeshShape>(&mesh, true), 0, btTransform::getIdentity()));
    }

    /// Masses are volumes times 1,000.
    std::array<Kind, 4> makeKinds()
    {
        auto& hull = makeShape<btConvexHullShape>();
        for (const btVector3& point : {btVector3(0, 1, 0), btVector3(1, 0, 0), btVector3(-1, 0, 0),
                                       btVector3(0, 0, 1), btVector3(0, 0, -1)})
            hull.addPoint(point);
        const btScalar half = btScalar(0.5), threeQuarters = btScalar(0.75);
        return {{{makeShape<btBoxShape>(btVector3(half, threeQuarters, 1)), 3000},
                 {makeShape<btSphereShape>(half), btScalar(523.6)},
                 {makeShape<btCapsuleShape>(half, 2 * threeQuarters), btScalar(1701.7)},
                 {hull, btScalar(666.7)}}};
    }
};
}  // namespace

std::unique_ptr<WorldScene> makeConvexMeshScene(const std::string& name, NamedBroadphase broadphase,
                                                const WorldSceneOptions& options)
{
    return std::make_unique<ConvexMeshWorld>(name, std::move(broadphase), options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
