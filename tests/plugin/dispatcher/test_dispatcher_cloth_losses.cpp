// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The cases of `cullet bench losses` with cloths: cullet's dispatcher leaves them to Bullet's algorithms, and adds no work.
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

namespace cullet::test
{
namespace
{
/// What the steps of a cloth that falls onto a static shape took.
struct ClothWork
{
    std::vector<btScalar> nodes;  ///< coordinates at the end
    std::uint64_t contacts = 0;   ///< of nodes, summed over the steps
    std::uint64_t manifolds = 0;  ///< summed over the steps
    int distances = 0;            ///< asked of Bullet's field of distances
};

/// Hills of 72 triangles with edges of a metre.
class Hills
{
public:
    Hills()
    {
        const auto corner = [](int x, int z)
        { return vec(x, 0.3 * std::sin(double(x)) * std::cos(double(z)), z); };
        for (int i = 0; i < 36; ++i)
        {
            const int x = i % 6 - 3, z = i / 6 - 3;
            m_triangles.addTriangle(corner(x, z), corner(x, z + 1), corner(x + 1, z));
            m_triangles.addTriangle(corner(x + 1, z), corner(x, z + 1), corner(x + 1, z + 1));
        }
        m_shape = std::make_unique<btBvhTriangleMeshShape>(&m_triangles, true);
    }
    btCollisionShape& shape() { return *m_shape; }

private:
    btTriangleMesh m_triangles;
    std::unique_ptr<btBvhTriangleMeshShape> m_shape;
};

template <class AnyDispatcher>
ClothWork workOfCloth(btCollisionShape& ground, btCollisionConfiguration& configuration,
                      AnyDispatcher& dispatcher)
{
    ClothWork work;
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
    btSoftBodyWorldInfo& info = world.getWorldInfo();
    info.m_sparsesdf.Initialize();
    btRigidBody body(0, nullptr, &ground);
    world.addRigidBody(&body);
    constexpr int kNodes = 9;
    btSoftBody* const cloth = btSoftBodyHelpers::CreatePatch(
        info, vec(-1, 0.9, -1), vec(1, 0.9, -1), vec(-1, 0.9, 1), vec(1, 0.9, 1), kNodes, kNodes, 0, true);
    cloth->setTotalMass(1, true);
    world.addSoftBody(cloth);
    for (int step = 0; step < 60; ++step)
    {
        world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
        work.contacts += static_cast<std::uint64_t>(cloth->m_rcontacts.size());
        work.manifolds += static_cast<std::uint64_t>(dispatcher.getNumManifolds());
    }
    work.distances = info.m_sparsesdf.nqueries;
    for (int i = 0; i < 3 * cloth->m_nodes.size(); ++i)
        work.nodes.push_back(cloth->m_nodes[i / 3].m_x[i % 3]);
    world.removeSoftBody(cloth);
    delete cloth;
    world.removeRigidBody(&body);
    return work;
}

void expectWorkOfBullet(btCollisionShape& ground)
{
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher stock(&configuration);
    const ClothWork bullet = workOfCloth(ground, configuration, stock);
    DispatcherOptions options;
    options.threads = 1;
    Dispatcher dispatcher(&configuration, options);
    const ClothWork own = workOfCloth(ground, configuration, dispatcher);
    EXPECT_GT(bullet.contacts, 500u) << "the sample has a cloth that lies";
    EXPECT_EQ(own.contacts, bullet.contacts);
    EXPECT_EQ(own.distances, bullet.distances);
    EXPECT_EQ(own.manifolds, bullet.manifolds);
    EXPECT_TRUE(own.nodes == bullet.nodes) << "the same bits";
    const IsaGjkStats stats = dispatcher.stats();
    EXPECT_EQ(stats.separatedTotal + stats.touchingTotal + stats.delegatedTotal + stats.notConvergedTotal +
                  stats.trianglesTotal,
              0u);
}

TEST(DispatcherLossesOfCloths, LeaveClothsOnHullToBulletsAlgorithm)
{
    btConvexHullShape hull;
    for (int i = 0; i < 8; ++i)
        hull.addPoint(vec(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5));
    expectWorkOfBullet(hull);
}

TEST(DispatcherLossesOfCloths, LeaveClothsOnMeshToBulletsAlgorithm)
{
    Hills hills;
    expectWorkOfBullet(hills.shape());
}
}  // namespace
}  // namespace cullet::test
