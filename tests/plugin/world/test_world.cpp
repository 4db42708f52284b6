// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// World<Base> behaves like Base, bit for bit: each test steps both and compares fingerprints of every step.
#include "cullet/plugin/shapes/thread_safe_aabb.h"
#include "cullet/plugin/world.h"
#include "cullet/tests/plugin/world_crowd.h"

#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorldMt.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
struct Stage
{
    explicit Stage(std::unique_ptr<btBroadphaseInterface> made) : broadphase(std::move(made)) {}
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    std::unique_ptr<btBroadphaseInterface> broadphase;
};

template <class W>
struct PlainStage : Stage
{
    using Stage::Stage;
    W world{&dispatcher, broadphase.get(), &configuration};
};
template <class W>
struct RigidStage : Stage
{
    using Stage::Stage;
    btSequentialImpulseConstraintSolver solver;
    W world{&dispatcher, broadphase.get(), &solver, &configuration};
};
template <class W>
struct MultiBodyStage : Stage
{
    using Stage::Stage;
    btMultiBodyConstraintSolver solver;
    W world{&dispatcher, broadphase.get(), &solver, &configuration};
};
template <class W>
struct DeformableStage : Stage
{
    explicit DeformableStage(std::unique_ptr<btBroadphaseInterface> made) : Stage(std::move(made))
    {
        solver.setDeformableSolver(&deformableSolver);
    }
    btDeformableBodySolver deformableSolver;
    btDeformableMultiBodyConstraintSolver solver;
    W world{&dispatcher, broadphase.get(), &solver, &configuration, &deformableSolver};
};

/// A link collider or a soft body, if the world supports it, since their boxes differ from those of rigid bodies.
template <class W>
class Guest
{
public:
    explicit Guest(W& world, btBroadphaseInterface& broadphase) : m_world(world)
    {
        if constexpr (kIsMultiBody)
        {
            m_collider.setCollisionShape(&m_ball);
            m_collider.setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(5, 9, 5)));
            m_body.setBasePos(vec(5, 9, 5));
            m_body.setBaseCollider(&m_collider);
            m_body.finalizeMultiDof();
            world.addMultiBody(&m_body);
            world.addCollisionObject(&m_collider);
        }
        if constexpr (kIsSoft)
        {
            world.getWorldInfo().m_broadphase = &broadphase;
            world.getWorldInfo().m_dispatcher = world.getDispatcher();
            world.getWorldInfo().m_sparsesdf.Initialize();
            m_cloth.reset(btSoftBodyHelpers::CreatePatch(world.getWorldInfo(), vec(-3, 1, -3), vec(-2, 1, -3),
                                                         vec(-3, 1, -2), vec(-2, 1, -2), 4, 4, 0, true));
            m_cloth->m_cfg.collisions = btSoftBody::fCollision::SDF_RS;
            world.addSoftBody(m_cloth.get());
        }
    }
    ~Guest()
    {
        if constexpr (kIsSoft)
            m_world.removeSoftBody(m_cloth.get());
        if constexpr (kIsMultiBody)
        {
            m_world.removeCollisionObject(&m_collider);
            m_world.removeMultiBody(&m_body);
        }
    }
    Guest(const Guest&) = delete;
    Guest& operator=(const Guest&) = delete;

private:
    static constexpr bool kIsMultiBody = std::is_base_of_v<btMultiBodyDynamicsWorld, W>;
    static constexpr bool kIsSoft =
        std::is_base_of_v<btSoftRigidDynamicsWorld, W> || std::is_base_of_v<btSoftMultiBodyDynamicsWorld, W>;
    W& m_world;
    btSphereShape m_ball{btScalar(0.5)};
    btMultiBody m_body{0, 1, vec(0.4, 0.4, 0.4), false, true};
    btMultiBodyLinkCollider m_collider{&m_body, -1};
    std::unique_ptr<btSoftBody> m_cloth;
};

constexpr int kSteps = 10;

/// Prepares a world after its crowd and guest were added.
using Prepare = void (*)(btCollisionWorld&);

/// Fingerprints of a world after each step.
template <class StageT>
std::vector<std::uint64_t> history(std::unique_ptr<btBroadphaseInterface> broadphase, int threads,
                                   Prepare prepare = nullptr)
{
    using W = decltype(StageT::world);
    constexpr bool kIsOurs = !std::is_same_v<decltype(&W::updateAabbs), void (btCollisionWorld::*)()> &&
                             !std::is_same_v<decltype(&W::updateAabbs), void (btSimpleDynamicsWorld::*)()>;
    StageT stage(std::move(broadphase));
    Crowd crowd(stage.world);
    const Guest<W> guest(stage.world, *stage.broadphase);
    if (prepare != nullptr)
        prepare(stage.world);
    if constexpr (kIsOurs)
        stage.world.setUpdateThreads(threads);
    std::vector<std::uint64_t> hashes;
    for (int step = 0; step < kSteps; ++step)
    {
        if constexpr (std::is_base_of_v<btDynamicsWorld, W>)
        {
            stage.world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
        }
        else
        {
            crowd.drift(step);
            stage.world.performDiscreteCollisionDetection();
        }
        hashes.push_back(hashOfWorld(stage.world));
    }
    EXPECT_NE(hashes.front(), hashes.back());
    EXPECT_EQ(crowd.shapes.lazy->foreignCalls, 0) << "a shape of the application was asked on another thread";
    if constexpr (kIsOurs)
    {
        EXPECT_GT(stage.world.updateStats().parallelBoxes, 200u);
        EXPECT_GT(stage.world.updateStats().serialBoxes, 20u);
    }
    return hashes;
}

template <template <class> class StageT, class Base>
struct Kind
{
    using Serial = StageT<Base>;
    using Parallel = StageT<World<Base>>;
};

template <class Kind>
class ParallelWorld : public testing::Test
{
};
using Kinds =
    testing::Types<Kind<PlainStage, btCollisionWorld>, Kind<RigidStage, btSimpleDynamicsWorld>,
                   Kind<RigidStage, btDiscreteDynamicsWorld>, Kind<MultiBodyStage, btMultiBodyDynamicsWorld>,
                   Kind<RigidStage, btSoftRigidDynamicsWorld>,
                   Kind<MultiBodyStage, btSoftMultiBodyDynamicsWorld>,
                   Kind<DeformableStage, btDeformableMultiBodyDynamicsWorld>>;
TYPED_TEST_SUITE(ParallelWorld, Kinds);

TYPED_TEST(ParallelWorld, StepsAsTheSerialOneBitForBit)
{
    const auto serial = history<typename TypeParam::Serial>(std::make_unique<Broadphase>(), 0);
    EXPECT_EQ(history<typename TypeParam::Parallel>(std::make_unique<Broadphase>(), 3), serial);
}

using Discrete = Kind<RigidStage, btDiscreteDynamicsWorld>;

void leaveSleepersAlone(btCollisionWorld& world)
{
    world.setForceUpdateAllAabbs(false);
    world.getDispatchInfo().m_useContinuous = false;
}

TEST(ParallelWorlds, GiveSameBitsOnAnyNumberOfThreads)
{
    const auto serial = history<Discrete::Serial>(std::make_unique<Broadphase>(), 0);
    for (const int threads : {1, 2, 8})
        EXPECT_EQ(history<Discrete::Parallel>(std::make_unique<Broadphase>(), threads), serial) << threads;
}

TEST(ParallelWorlds, FollowForceUpdateAndContinuousSettings)
{
    const auto usual = history<Discrete::Serial>(std::make_unique<Broadphase>(), 0);
    const auto serial = history<Discrete::Serial>(std::make_unique<Broadphase>(), 0, leaveSleepersAlone);
    EXPECT_NE(serial, usual);
    EXPECT_EQ(history<Discrete::Parallel>(std::make_unique<Broadphase>(), 3, leaveSleepersAlone), serial);
}

/// Whether World takes over the solver, prediction, CCD, integration and deactivation of a class.
template <class Base>
std::vector<bool> layersOf()
{
    using Asked = world_layers::Origins<Base>;
    return {Asked::solves(), Asked::predicts(), Asked::sweeps(), Asked::integrates(), Asked::activates()};
}

TEST(ParallelWorlds, TakeOverWhatTheirClassInherits)
{
    EXPECT_EQ(layersOf<btCollisionWorld>(), std::vector<bool>({false, false, false, false, false}));
    EXPECT_EQ(layersOf<btSimpleDynamicsWorld>(), std::vector<bool>({false, false, false, false, false}));
    EXPECT_EQ(layersOf<btDiscreteDynamicsWorld>(), std::vector<bool>({true, true, true, true, true}));
    EXPECT_EQ(layersOf<btSoftRigidDynamicsWorld>(), std::vector<bool>({true, false, true, true, true}));
    EXPECT_EQ(layersOf<btMultiBodyDynamicsWorld>(), std::vector<bool>({false, false, true, false, false}));
    EXPECT_EQ(layersOf<btSoftMultiBodyDynamicsWorld>(),
              std::vector<bool>({false, false, true, false, false}));
    EXPECT_EQ(layersOf<btDiscreteDynamicsWorldMt>(), std::vector<bool>({false, false, false, false, true}));
}

TEST(ParallelWorlds, TestRaysWhereTheirClassInheritsThat)
{
    EXPECT_TRUE(world_layers::Origins<btCollisionWorld>::testsRays());
    EXPECT_TRUE(world_layers::Origins<btDiscreteDynamicsWorld>::testsRays());
    EXPECT_TRUE(world_layers::Origins<btMultiBodyDynamicsWorld>::testsRays());
    // They test soft bodies, too.
    EXPECT_FALSE(world_layers::Origins<btSoftRigidDynamicsWorld>::testsRays());
    EXPECT_FALSE(world_layers::Origins<btSoftMultiBodyDynamicsWorld>::testsRays());
}

TEST(ParallelWorlds, SetBoxesInBulletsOrderForAnyBroadphase)
{
    const auto dbvt = history<Discrete::Serial>(std::make_unique<btDbvtBroadphase>(), 0);
    EXPECT_EQ(history<Discrete::Parallel>(std::make_unique<btDbvtBroadphase>(), 3), dbvt);
    const auto makeSweep = []
    { return std::make_unique<bt32BitAxisSweep3>(vec(-1e6, -1e6, -1e6), vec(1e6, 1e6, 1e6), 2000u); };
    const auto sweep = history<Discrete::Serial>(makeSweep(), 0);
    EXPECT_EQ(history<Discrete::Parallel>(makeSweep(), 3), sweep);
}

TEST(ParallelWorlds, SetBoxesAsBulletForAnotherBroadphaseOnOneThread)
{
    Discrete::Serial bullet(std::make_unique<btDbvtBroadphase>());
    Discrete::Parallel own(std::make_unique<btDbvtBroadphase>());
    Crowd inBullet(bullet.world), inOwn(own.world);
    own.world.setUpdateThreads(1);
    for (int step = 0; step < kSteps; ++step)
    {
        bullet.world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
        own.world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
        ASSERT_EQ(hashOfWorld(own.world), hashOfWorld(bullet.world)) << step;
    }
    EXPECT_EQ(own.world.updateStats().parallelBoxes, 0u);
    EXPECT_EQ(own.world.updateStats().serialBoxes, std::uint64_t(own.world.getNumCollisionObjects()));
}

/// A world with a crowd and a ghost, whose pairs appear in the order in which boxes are set.
template <class StageT>
std::vector<std::uint64_t> historyWithGhost()
{
    StageT stage(std::make_unique<Broadphase>());
    btGhostPairCallback callback;
    stage.world.getPairCache()->setInternalGhostPairCallback(&callback);
    Crowd crowd(stage.world);
    btSphereShape shape(6);
    if constexpr (!std::is_same_v<decltype(StageT::world), btDiscreteDynamicsWorld>)
        stage.world.setUpdateThreads(3);
    btPairCachingGhostObject ghost;
    ghost.setCollisionShape(&shape);
    ghost.getWorldTransform().setOrigin(vec(12, 1, 12));
    stage.world.addCollisionObject(&ghost);
    std::vector<std::uint64_t> hashes;
    for (int step = 0; step < kSteps; ++step)
    {
        stage.world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
        hashes.push_back(hashOfWorld(stage.world) + std::uint64_t(ghost.getNumOverlappingObjects()));
    }
    EXPECT_GT(ghost.getNumOverlappingObjects(), 15);
    if constexpr (!std::is_same_v<decltype(StageT::world), btDiscreteDynamicsWorld>)
    {
        EXPECT_GT(stage.world.updateStats().parallelBoxes, 200u);
        EXPECT_FALSE(stage.world.updateStats().hasParallelSets);
    }
    stage.world.removeCollisionObject(&ghost);
    return hashes;
}

TEST(ParallelWorlds, ReportGhostPairsInOrderOfSerialWorld)
{
    EXPECT_EQ(historyWithGhost<Discrete::Parallel>(), historyWithGhost<Discrete::Serial>());
}

/// A ghost whose next visitor causes bodies of the world to be replaced: the last one is created again elsewhere, at
/// the same address and index; before that others may be removed and added.
class ReplacingGhost : public btGhostObject
{
public:
    ReplacingGhost(btCollisionWorld& world, std::vector<std::unique_ptr<btCollisionObject>>& objects)
        : m_world(world), m_objects(objects)
    {
    }
    void addOverlappingObjectInternal(btBroadphaseProxy* other, btBroadphaseProxy* own) override
    {
        btGhostObject::addOverlappingObjectInternal(other, own);
        if (!isArmed)
            return;
        isArmed = false;
        for (std::size_t i = 0; i < m_objects.size() && newObjects > 0; i += 100)
            remove(i + 50);
        for (int i = 0; i < newObjects; ++i)
            add(std::make_unique<btCollisionObject>(), 1000.0 + i);
        btCollisionObject* const last =
            m_world.getCollisionObjectArray()[m_world.getNumCollisionObjects() - 1];
        m_world.removeCollisionObject(last);
        last->getWorldTransform().setOrigin(vec(0, 0, 500));
        m_world.addCollisionObject(last);
    }
    void add(std::unique_ptr<btCollisionObject> object, double x)
    {
        object->setCollisionShape(&m_ball);
        object->getWorldTransform().setIdentity();
        object->getWorldTransform().setOrigin(vec(x, 0, 0));
        if (areStatic)
        {
            // As after a step of a world with dynamics, so that those that do not move are at rest.
            object->setCollisionFlags(btCollisionObject::CF_STATIC_OBJECT);
            object->setIslandTag(-1);
            object->setCompanionId(-2);
        }
        m_world.addCollisionObject(object.get());
        m_objects.push_back(std::move(object));
    }

    bool isArmed = false;
    int newObjects = 0;
    bool areStatic = false;

private:
    void remove(std::size_t index)
    {
        m_world.removeCollisionObject(m_objects[index].get());
        m_objects[index].reset();
    }

    btCollisionWorld& m_world;
    std::vector<std::unique_ptr<btCollisionObject>>& m_objects;
    btSphereShape m_ball{1};
};

/// Hashes of a world before and after a step in which a callback replaces objects.
///
/// @param areStatic whether the objects are static, and two thirds of them do not move
template <class StageT>
std::vector<std::uint64_t> historyOfReplacement(int newObjects, bool areStatic)
{
    // Bullet's tree must not change during its traversal.
    StageT stage(std::make_unique<Broadphase>());
    btGhostPairCallback callback;
    stage.world.getPairCache()->setInternalGhostPairCallback(&callback);
    std::vector<std::unique_ptr<btCollisionObject>> objects;
    ReplacingGhost ghost(stage.world, objects);
    btSphereShape shape(2);
    ghost.setCollisionShape(&shape);
    ghost.getWorldTransform().setIdentity();
    ghost.getWorldTransform().setOrigin(vec(0, 50, 0));
    ghost.newObjects = newObjects;
    ghost.areStatic = areStatic;
    stage.world.addCollisionObject(&ghost);
    for (int i = 0; i < 600; ++i)
        ghost.add(std::make_unique<btCollisionObject>(), 10.0 * i);
    std::vector<std::uint64_t> hashes;
    for (int step = 0; step < 3; ++step)
    {
        // The third one moves into the ghost.
        for (std::size_t i = 0; i < objects.size(); ++i)
        {
            if (objects[i] != nullptr && (!areStatic || i % 3 == 0))
                objects[i]->getWorldTransform().getOrigin() += vec(0.5, 0, 0);
        }
        if (step == 1)
            objects[2]->getWorldTransform().setOrigin(vec(0, 51, 0));
        ghost.isArmed = step == 1;
        stage.world.performDiscreteCollisionDetection();
        hashes.push_back(hashOfWorld(stage.world) + std::uint64_t(ghost.getNumOverlappingObjects()));
    }
    EXPECT_FALSE(ghost.isArmed);
    EXPECT_EQ(stage.world.getNumCollisionObjects(), 1 + 600 + (newObjects > 0 ? newObjects - 6 : 0));
    for (const auto& object : objects)
    {
        if (object != nullptr)
            stage.world.removeCollisionObject(object.get());
    }
    stage.world.removeCollisionObject(&ghost);
    return hashes;
}

TEST(ParallelWorlds, MatchSerialWorldWhenCallbackRemovesAndAddsBodies)
{
    using Plain = Kind<PlainStage, btCollisionWorld>;
    for (const int newObjects : {0, 3, 6, 20})
    {
        for (const bool areStatic : {false, true})
        {
            EXPECT_EQ(historyOfReplacement<Plain::Parallel>(newObjects, areStatic),
                      historyOfReplacement<Plain::Serial>(newObjects, areStatic))
                << newObjects << (areStatic ? " static" : "");
        }
    }
}

TEST(ParallelWorlds, DisableSimulationOfOversizedBody)
{
    Discrete::Parallel stage(std::make_unique<Broadphase>());
    stage.world.setUpdateThreads(2);
    Crowd crowd(stage.world);
    EXPECT_NE(crowd.hugeBody().getActivationState(), DISABLE_SIMULATION);
    stage.world.updateAabbs();
    EXPECT_EQ(crowd.hugeBody().getActivationState(), DISABLE_SIMULATION);
    EXPECT_TRUE(stage.world.updateStats().hasParallelSets);
}

TEST(ParallelWorlds, ComputeBoxesSeriallyWhenWorldIsSmall)
{
    Discrete::Parallel stage(std::make_unique<Broadphase>());
    btSphereShape shape(1);
    btRigidBody body(1, nullptr, &shape);
    stage.world.addRigidBody(&body);
    body.getWorldTransform().setOrigin(vec(0, 5, 0));
    stage.world.updateAabbs();
    EXPECT_NEAR(double(body.getBroadphaseHandle()->m_aabbMax.y()), 6.02, 1e-5);
    EXPECT_EQ(stage.world.updateStats().parallelBoxes, 0u);
    stage.world.removeRigidBody(&body);
}

TEST(PureAabb, HoldsOnlyForShapesKnownToBeThreadSafe)
{
    const MixedShapes mixed;
    for (std::size_t i = 0; i < mixed.shapes.size(); ++i)
        EXPECT_EQ(hasThreadSafeAabb(*mixed.shapes[i]), i < mixed.pureCount) << mixed.shapes[i]->getName();
}
}  // namespace
}  // namespace cullet::test
