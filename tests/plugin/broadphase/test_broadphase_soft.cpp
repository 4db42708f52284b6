// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Worlds with soft bodies set boxes before updateAabbs() does, with a dispatcher that may be null, and override
// rayTest.
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <memory>

namespace cullet::test
{
namespace
{
struct SoftStage
{
    explicit SoftStage(std::unique_ptr<btBroadphaseInterface> made) : broadphase(std::move(made)) {}
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    std::unique_ptr<btBroadphaseInterface> broadphase;
};

struct SoftRigidWorld : SoftStage
{
    using SoftStage::SoftStage;
    static constexpr bool kClothStops = true;
    void prepare(btSoftBody&) {}
    btSequentialImpulseConstraintSolver solver;
    btSoftRigidDynamicsWorld world{&dispatcher, broadphase.get(), &solver, &configuration};
};
struct SoftMultiBodyWorld : SoftStage
{
    using SoftStage::SoftStage;
    static constexpr bool kClothStops = true;
    void prepare(btSoftBody&) {}
    btMultiBodyConstraintSolver solver;
    btSoftMultiBodyDynamicsWorld world{&dispatcher, broadphase.get(), &solver, &configuration};
};
struct DeformableWorld : SoftStage
{
    static constexpr bool kClothStops = false;  // contacts depend on solver settings
    explicit DeformableWorld(std::unique_ptr<btBroadphaseInterface> made) : SoftStage(std::move(made))
    {
        solver.setDeformableSolver(&deformableSolver);
    }
    void prepare(btSoftBody& cloth)
    {
        world.addForce(&cloth, &gravity);
        world.addForce(&cloth, &springs);
        cloth.m_cfg.collisions = btSoftBody::fCollision::SDF_RD;
    }
    btDeformableGravityForce gravity{vec(0, -10, 0)};
    btDeformableMassSpringForce springs{btScalar(30), btScalar(1), true};
    btDeformableBodySolver deformableSolver;
    btDeformableMultiBodyConstraintSolver solver;
    btDeformableMultiBodyDynamicsWorld world{&dispatcher, broadphase.get(), &solver, &configuration,
                                             &deformableSolver};
};

/// The lowest node of a cloth that falls over a box.
template <class Stage>
double dropCloth(std::unique_ptr<btBroadphaseInterface> broadphase)
{
    Stage stage(std::move(broadphase));
    stage.world.setGravity(vec(0, -10, 0));
    btSoftBodyWorldInfo& info = stage.world.getWorldInfo();
    info.m_broadphase = stage.broadphase.get();
    info.m_dispatcher = nullptr;  // the default: setAabb() is called with a null dispatcher
    info.m_gravity.setValue(0, -10, 0);
    info.m_sparsesdf.Initialize();

    btBoxShape boxShape(vec(5, 1, 5));
    btRigidBody box(0, nullptr, &boxShape);
    box.setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(0, -1, 0)));
    stage.world.addRigidBody(&box);

    btSoftBody* cloth = btSoftBodyHelpers::CreatePatch(info, vec(-1, 1, -1), vec(1, 1, -1), vec(-1, 1, 1),
                                                       vec(1, 1, 1), 6, 6, 0, true);
    cloth->setTotalMass(1);
    cloth->getCollisionShape()->setMargin(btScalar(0.1));
    cloth->m_cfg.collisions = btSoftBody::fCollision::SDF_RS;
    stage.world.addSoftBody(cloth);
    stage.prepare(*cloth);
    int stepsWithAPair = 0;
    for (int i = 0; i < 120; ++i)
    {
        stage.world.stepSimulation(btScalar(1) / 240, 0, btScalar(1) / 240);
        stage.world.stepSimulation(btScalar(1) / 240, 0, btScalar(1) / 240);
        stepsWithAPair += stage.world.getPairCache()->getNumOverlappingPairs();
    }
    EXPECT_GT(stepsWithAPair, 10);

    double lowest = 1e9;
    for (int i = 0; i < cloth->m_nodes.size(); ++i)
        lowest = std::min(lowest, double(cloth->m_nodes[i].m_x.y()));
    btCollisionWorld::ClosestRayResultCallback ray(vec(0, 9, 0.1), vec(0, -9, 0.1));
    stage.world.rayTest(ray.m_rayFromWorld, ray.m_rayToWorld, ray);
    EXPECT_TRUE(ray.hasHit()) << "these worlds pass 1e30 for axes without direction";
    stage.world.removeSoftBody(cloth);
    delete cloth;
    stage.world.removeRigidBody(&box);
    return lowest;
}

template <class Stage>
class BroadphaseSoftWorld : public testing::Test
{
};
using SoftWorlds = testing::Types<SoftRigidWorld, SoftMultiBodyWorld, DeformableWorld>;
TYPED_TEST_SUITE(BroadphaseSoftWorld, SoftWorlds);

TYPED_TEST(BroadphaseSoftWorld, DropsClothOntoBoxAsWithDbvt)
{
    const double ours = dropCloth<TypeParam>(std::make_unique<Broadphase>());
    const double stock = dropCloth<TypeParam>(std::make_unique<btDbvtBroadphase>());
    EXPECT_LT(ours, 0.5) << "the cloth has not come down";
    if (TypeParam::kClothStops)
    {
        EXPECT_GT(ours, -0.2) << "the cloth went through the box";
    }
    EXPECT_NEAR(ours, stock, 0.02);
}
}  // namespace
}  // namespace cullet::test
