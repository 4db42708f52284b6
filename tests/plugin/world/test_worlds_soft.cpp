// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Soft bodies in contact with each other and with rigid bodies. Their boxes are set in the middle of a step, before
// updateAabbs().
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/isa_gjk.h"
#include "cullet/plugin/solver.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <BulletSoftBody/btSoftBodyConcaveCollisionAlgorithm.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <vector>

namespace cullet::test
{
namespace
{
class SoftScene
{
public:
    explicit SoftScene(btBroadphaseInterface& broadphase) : SoftScene(broadphase, nullptr) {}
    /// @param solver of rigid bodies; null: Bullet's
    SoftScene(btBroadphaseInterface& broadphase, btConstraintSolver* solver)
        : world(&m_dispatcher, &broadphase, solver != nullptr ? solver : &m_solver, &m_configuration)
    {
        world.setGravity(vec(0, -10, 0));
        btSoftBodyWorldInfo& info = world.getWorldInfo();
        info.m_broadphase = &broadphase;
        info.m_dispatcher = &m_dispatcher;
        info.m_gravity.setValue(0, -10, 0);
        info.m_sparsesdf.Initialize();
        m_floor.setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(0, -1, 0)));
        world.addRigidBody(&m_floor);
    }
    ~SoftScene()
    {
        while (world.getSoftBodyArray().size() > 0)
        {
            btSoftBody* body = world.getSoftBodyArray()[0];
            world.removeSoftBody(body);
            delete body;
        }
        world.removeRigidBody(&m_floor);
    }
    SoftScene(const SoftScene&) = delete;
    SoftScene& operator=(const SoftScene&) = delete;

    void step(int count)
    {
        for (int i = 0; i < count; ++i)
            world.stepSimulation(btScalar(1) / 120, 0, btScalar(1) / 120);
    }

private:
    btSoftBodyRigidBodyCollisionConfiguration m_configuration;
    btCollisionDispatcher m_dispatcher{&m_configuration};
    btSequentialImpulseConstraintSolver m_solver;
    btBoxShape m_floorShape{vec(10, 1, 10)};
    btRigidBody m_floor{0, nullptr, &m_floorShape};

public:
    btSoftRigidDynamicsWorld world;
};

double meanHeight(const btSoftBody& body)
{
    double sum = 0;
    for (int i = 0; i < body.m_nodes.size(); ++i)
        sum += double(body.m_nodes[i].m_x.y());
    return sum / body.m_nodes.size();
}

void expectNear(const std::vector<double>& values, const std::vector<double>& expected, double tolerance)
{
    ASSERT_EQ(values.size(), expected.size());
    for (std::size_t i = 0; i < values.size(); ++i)
        EXPECT_NEAR(values[i], expected[i], tolerance) << i;
}

/// Mean heights of a cloth that is held at its corners and of a smaller one that falls into it.
std::vector<double> dropClothIntoCloth(btBroadphaseInterface& broadphase)
{
    SoftScene scene(broadphase);
    btSoftBodyWorldInfo& info = scene.world.getWorldInfo();
    btSoftBody* net = btSoftBodyHelpers::CreatePatch(info, vec(-1, 2, -1), vec(1, 2, -1), vec(-1, 2, 1),
                                                     vec(1, 2, 1), 9, 9, 1 + 2 + 4 + 8, true);
    btSoftBody* cloth =
        btSoftBodyHelpers::CreatePatch(info, vec(-0.4, 2.5, -0.4), vec(0.4, 2.5, -0.4), vec(-0.4, 2.5, 0.4),
                                       vec(0.4, 2.5, 0.4), 5, 5, 0, true);
    net->setTotalMass(1);
    cloth->setTotalMass(btScalar(0.2));
    for (btSoftBody* body : {net, cloth})
    {
        body->m_cfg.collisions |= btSoftBody::fCollision::VF_SS;
        body->getCollisionShape()->setMargin(btScalar(0.1));
        scene.world.addSoftBody(body);
    }
    scene.step(120);
    EXPECT_GT(meanHeight(*cloth), 0.5) << "the net has not held the cloth";
    EXPECT_LT(meanHeight(*cloth), 2.3) << "the cloth has not come down";
    return {meanHeight(*net), meanHeight(*cloth)};
}

TEST(WorldsSoftBodies, MatchDbvtWhenClothFallsIntoCloth)
{
    Broadphase own;
    btDbvtBroadphase stock;
    expectNear(dropClothIntoCloth(own), dropClothIntoCloth(stock), 0.05);
}

/// Heights of a weight that hangs on a rope, and of the rope.
std::vector<double> hangAWeight(btBroadphaseInterface& broadphase)
{
    SoftScene scene(broadphase);
    btBoxShape shape(vec(0.2, 0.2, 0.2));
    btVector3 inertia;
    shape.calculateLocalInertia(1, inertia);
    btRigidBody weight(1, nullptr, &shape, inertia);
    weight.setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(2, 4, 0)));
    scene.world.addRigidBody(&weight);
    btSoftBody* rope =
        btSoftBodyHelpers::CreateRope(scene.world.getWorldInfo(), vec(0, 4, 0), vec(2, 4, 0), 8, 1);
    rope->setTotalMass(btScalar(0.5));
    rope->m_cfg.piterations = 8;
    rope->appendAnchor(rope->m_nodes.size() - 1, &weight, true);
    scene.world.addSoftBody(rope);
    scene.step(120);
    const double height = double(weight.getWorldTransform().getOrigin().y());
    EXPECT_LT(height, 3.5) << "the weight has not swung down";
    EXPECT_GT(height, 0.1) << "the rope has let it fall";
    const double ropeHeight = meanHeight(*rope);
    scene.world.removeSoftBody(rope);
    delete rope;
    scene.world.removeRigidBody(&weight);
    return {height, ropeHeight};
}

TEST(WorldsSoftBodies, MatchDbvtWhenWeightHangsOnRope)
{
    Broadphase own;
    btDbvtBroadphase stock;
    expectNear(hangAWeight(own), hangAWeight(stock), 0.02);
}

/// Mean heights of boxes that stand on each other and of a cloth that falls on them.
std::vector<double> coverBoxes(btConstraintSolver* solver)
{
    btDbvtBroadphase broadphase;
    SoftScene scene(broadphase, solver);
    btBoxShape shape(vec(0.3, 0.3, 0.3));
    btVector3 inertia;
    shape.calculateLocalInertia(1, inertia);
    btRigidBody lower(1, nullptr, &shape, inertia), upper(1, nullptr, &shape, inertia);
    btSoftBody* cloth =
        btSoftBodyHelpers::CreatePatch(scene.world.getWorldInfo(), vec(-1, 1.6, -1), vec(1, 1.6, -1),
                                       vec(-1, 1.6, 1), vec(1, 1.6, 1), 11, 11, 0, true);
    cloth->setTotalMass(btScalar(0.5));
    scene.world.addSoftBody(cloth);
    std::vector<double> heights;
    for (btRigidBody* body : {&lower, &upper})
    {
        body->setWorldTransform(
            btTransform(btQuaternion::getIdentity(), vec(0, body == &lower ? 0.3 : 0.9, 0)));
        scene.world.addRigidBody(body);
    }
    scene.step(180);
    for (btRigidBody* body : {&lower, &upper})
    {
        heights.push_back(double(body->getWorldTransform().getOrigin().y()));
        scene.world.removeRigidBody(body);
    }
    heights.push_back(meanHeight(*cloth));
    EXPECT_LT(heights.back(), 1.3) << "the cloth has not come down";
    return heights;
}

TEST(WorldsSoftBodies, LieOnRigidBodiesOfCulletsSolverAsOfBullets)
{
    const std::vector<double> expected = coverBoxes(nullptr);
    for (const SolverModel model : {SolverModel::Bullet, SolverModel::Soft})
    {
        SolverOptions options;
        options.model = model;
        Solver solver(options);
        expectNear(coverBoxes(&solver), expected, 0.03);
        EXPECT_EQ(solver.stats().refusedGroups, 0u);
        EXPECT_GE(solver.stats().contacts, 2u);
    }
}

/// The cells of soft bodies are not those that cullet replaces.
TEST(WorldsSoftBodies, MeetMeshesByBulletsAlgorithmWithIsaGjk)
{
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    registerIsaGjk(dispatcher);
    btSoftBodyWorldInfo info;
    btSoftBody soft(&info);
    btTriangleMesh triangles;
    triangles.addTriangle(vec(-1, 0, -1), vec(1, 0, -1), vec(0, 0, 1));
    btBvhTriangleMeshShape shape(&triangles, true);
    btCollisionObject mesh;
    mesh.setCollisionShape(&shape);
    const btTransform identity = btTransform::getIdentity();
    const btCollisionObjectWrapper wrapSoft(nullptr, soft.getCollisionShape(), &soft, identity, -1, -1),
        wrapMesh(nullptr, &shape, &mesh, identity, -1, -1);
    for (const bool isMeshFirst : {false, true})
    {
        btCollisionAlgorithm* const algorithm =
            dispatcher.findAlgorithm(isMeshFirst ? &wrapMesh : &wrapSoft, isMeshFirst ? &wrapSoft : &wrapMesh,
                                     nullptr, BT_CONTACT_POINT_ALGORITHMS);
        EXPECT_TRUE(isExactly<btSoftBodyConcaveCollisionAlgorithm>(*algorithm));
        algorithm->~btCollisionAlgorithm();
        dispatcher.freeCollisionAlgorithm(algorithm);
    }
}
}  // namespace
}  // namespace cullet::test
