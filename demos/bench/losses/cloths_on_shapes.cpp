// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/losses/cloths_on_shapes.h"

#include "cullet/demos/scenes/hulls/hull_points.h"
#include "cullet/demos/scenes/worlds/lattice_mesh.h"
#include "cullet/demos/scenes/worlds/soft_world.h"

#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
class ClothsOnShapes final : public WorldScene
{
public:
    ClothsOnShapes(ClothGround ground, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene("cloths-on-shapes", std::move(broadphase), scene, softWorldKind())
    {
        const auto cloths = static_cast<int>(scene.bodies);
        if (ground == ClothGround::Mesh)
            addHills(cloths);
        else
            addHulls(cloths);
        for (int i = 0; i < cloths; ++i)
            addCloth(btScalar(kWidth) * btScalar(i));
    }

private:
    static constexpr int kWidth = 5;  ///< from cloth to cloth
    static constexpr int kNodes = 17;

    btSoftRigidDynamicsWorld& softRigidWorld() { return static_cast<btSoftRigidDynamicsWorld&>(world()); }

    void addHulls(int cloths)
    {
        auto& hull = makeShape<btConvexHullShape>();
        for (const Eigen::Vector3d& point : icoPoints(1))
            hull.addPoint(
                btVector3(btScalar(point[0]), btScalar(point[1]), btScalar(point[2])) * btScalar(0.45),
                false);
        hull.recalcLocalAabb();
        for (int i = 0; i < cloths; ++i)
        {
            for (int k = 0; k < 25; ++k)
                addBody(hull, 0,
                        transformAt(btVector3(btScalar(kWidth * i + k % 5 - 2), 0, btScalar(k / 5 - 2))));
        }
    }

    void addHills(int cloths)
    {
        btTriangleMesh& mesh = makeShape<btTriangleMesh>();
        const auto corner = [](int x, int z)
        {
            const btScalar px = btScalar(0.5) * btScalar(x), pz = btScalar(0.5) * btScalar(z);
            return btVector3(px, btScalar(0.3) * btSin(px) * btCos(pz), pz);
        };
        addLattice(mesh, {-6, 2 * kWidth * cloths}, {-6, 6}, corner);
        addBody(makeShape<btBvhTriangleMeshShape>(&mesh, true), 0, btTransform::getIdentity());
    }

    void addCloth(btScalar x)
    {
        const btScalar y = btScalar(0.7);
        btSoftBody& cloth = keep(std::unique_ptr<btSoftBody>(btSoftBodyHelpers::CreatePatch(
            softRigidWorld().getWorldInfo(), btVector3(x - 2, y, -2), btVector3(x + 2, y, -2),
            btVector3(x - 2, y, 2), btVector3(x + 2, y, 2), kNodes, kNodes, 0, true)));
        cloth.setTotalMass(1, true);
        cloth.m_cfg.kDF = btScalar(0.8);
        softRigidWorld().addSoftBody(&cloth);
    }
};
}  // namespace

std::unique_ptr<WorldScene> makeClothsOnShapes(ClothGround ground, const WorldSceneOptions& options)
{
    BroadphaseRequest request;
    request.name = options.backend;
    request.threads = options.threads;
    return std::make_unique<ClothsOnShapes>(ground, makeNamedBroadphase(request), options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
