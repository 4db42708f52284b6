// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A sleeping world whose loops leave all bodies out takes the steps of Bullet's world, bit by bit, when the application edits
// one body: each kind of edit at each moment at which the application's code runs.
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/world.h"
#include "cullet/tests/plugin/world/step_scene.h"
#include "cullet/tests/plugin/world_crowd.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <type_traits>
#include <vector>

namespace cullet::test
{
namespace
{
/// When the application edits a body.
enum class EditMoment : std::uint8_t
{
    BetweenSteps,
    BeforeSecondTick,
    AfterFirstTick,
    AfterTick,
    Action,
    KinematicMotionState,
    Synchronization,
    All
};

struct SleepEdit
{
    const char* name;
    void (*run)(btDiscreteDynamicsWorld& world, btRigidBody& body);
};

btTransform raised(const btRigidBody& body)
{
    btTransform transform = body.getWorldTransform();
    transform.getOrigin() += vec(0, 0.01, 0);
    return transform;
}

/// What an application may do to a sleeping body. Those that call the world use what they have edited before its next loop.
const SleepEdit kEdits[] = {
    {"nothing", [](btDiscreteDynamicsWorld&, btRigidBody&) {}},
    {"velocity", [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.setLinearVelocity(vec(0, 1, 0)); }},
    {"spin", [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.setAngularVelocity(vec(0, 1, 0)); }},
    {"velocity of -0",
     [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.setLinearVelocity(-btVector3(0, 0, 0)); }},
    {"force", [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.applyCentralForce(vec(0, 50, 0)); }},
    {"torque", [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.applyTorque(vec(0, 50, 0)); }},
    {"pose", [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.getWorldTransform() = raised(body); }},
    {"centre of mass",
     [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.setCenterOfMassTransform(raised(body)); }},
    {"prediction",
     [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.setInterpolationWorldTransform(raised(body)); }},
    {"wake", [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.activate(true); }},
    {"wake and fall",
     [](btDiscreteDynamicsWorld& world, btRigidBody& body)
     {
         body.activate(true);
         world.applyGravity();
     }},
    {"force and clear",
     [](btDiscreteDynamicsWorld& world, btRigidBody& body)
     {
         body.activate(true);
         body.applyCentralForce(vec(0, 50, 0));
         world.clearForces();
     }},
    {"wants sleep",
     [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.forceActivationState(WANTS_DEACTIVATION); }},
    {"no simulation",
     [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.forceActivationState(DISABLE_SIMULATION); }},
    {"deactivation time",
     [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.setDeactivationTime(btScalar(0.1)); }},
    {"hit fraction", [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.setHitFraction(btScalar(0.5)); }},
    {"island", [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.setIslandTag(0); }},
    {"companion", [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.setCompanionId(3); }},
    {"kinematic", [](btDiscreteDynamicsWorld&, btRigidBody& body)
     { body.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT); }},
    {"static", [](btDiscreteDynamicsWorld&, btRigidBody& body)
     { body.setCollisionFlags(btCollisionObject::CF_STATIC_OBJECT); }},
    {"no response", [](btDiscreteDynamicsWorld&, btRigidBody& body)
     { body.setCollisionFlags(btCollisionObject::CF_NO_CONTACT_RESPONSE); }},
    {"gravity", [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.setGravity(vec(0, 5, 0)); }},
    {"damping", [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.setDamping(btScalar(0.5), 1); }},
    {"mass", [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.setMassProps(3, vec(1, 2, 3)); }},
    {"swept",
     [](btDiscreteDynamicsWorld&, btRigidBody& body) { body.setCcdMotionThreshold(btScalar(0.001)); }},
    {"filter", [](btDiscreteDynamicsWorld&, btRigidBody& body)
     { body.getBroadphaseProxy()->m_collisionFilterMask ^= btBroadphaseProxy::DefaultFilter; }},
    {"scale", [](btDiscreteDynamicsWorld&, btRigidBody& body)
     { body.getCollisionShape()->setLocalScaling(vec(1, 1.01, 1)); }},
    {"added again",
     [](btDiscreteDynamicsWorld& world, btRigidBody& body)
     {
         world.removeRigidBody(&body);
         world.addRigidBody(&body);
     }},
    {"pairs removed", [](btDiscreteDynamicsWorld& world, btRigidBody& body)
     { world.getPairCache()->cleanProxyFromPairs(body.getBroadphaseProxy(), world.getDispatcher()); }},
    {"active floor", [](btDiscreteDynamicsWorld& world, btRigidBody&)
     { world.getCollisionObjectArray()[0]->forceActivationState(ACTIVE_TAG); }},
    {"no deactivation", [](btDiscreteDynamicsWorld&, btRigidBody&) { gDisableDeactivation = true; }},
    {"other world gravity",
     [](btDiscreteDynamicsWorld& world, btRigidBody&) { world.setGravity(vec(0, -5, 0)); }},
};

/// Sleeping piles, and an application that waits for its moment to edit a body.
class SleepScene final : public StepScene
{
public:
    static constexpr int kPiles = 180;

    explicit SleepScene(btDiscreteDynamicsWorld& world) : StepScene(world)
    {
        addFloor();
        auto& brick = makeShape<btBoxShape>(vec(0.3, 0.2, 0.3));
        m_ownShape = &makeShape<btBoxShape>(vec(0.3, 0.2, 0.3));
        for (int i = 0; i < 3 * kPiles; ++i)
            addBody(i == kEdited ? *m_ownShape : brick, 1,
                    vec(2 * (i / 3 % 15), 0.2 + 0.4 * (i % 3), 2 * (i / 45)));
        for (const auto& body : bodies())
            m_home.push_back(body->getWorldTransform());
        world.setInternalTickCallback(nullptr, this);
    }
    ~SleepScene() override { finish(); }

    btRigidBody& edited() { return *bodies()[std::size_t(1 + kEdited)]; }

    /// Prepares that the next step makes an edit at a moment.
    void prepare(const SleepEdit& edit, EditMoment moment)
    {
        m_moment = moment;
        m_ticks = 0;
        const bool isBefore = moment == EditMoment::BeforeSecondTick;
        const bool isAfter = moment == EditMoment::AfterTick || moment == EditMoment::AfterFirstTick;
        world().setInternalTickCallback(isBefore ? tick : nullptr, this, true);
        world().setInternalTickCallback(isAfter ? tick : nullptr, this, false);
        if (moment == EditMoment::Action)
            world().addAction(&m_action);
        btRigidBody& floor = *bodies().front();
        if (moment == EditMoment::KinematicMotionState)
        {
            floor.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
            floor.setMotionState(&m_state);
            floor.forceActivationState(DISABLE_DEACTIVATION);
        }
        if (moment == EditMoment::Synchronization)
        {
            world().setSynchronizeAllMotionStates(true);
            bodies()[1]->setMotionState(&m_state);
        }
        // After setMotionState(), which calls the motion state.
        m_edit = &edit;
        if (moment == EditMoment::BetweenSteps)
            editNow();
    }
    void step(int) override
    {
        const bool isTwice =
            m_moment == EditMoment::BeforeSecondTick || m_moment == EditMoment::AfterFirstTick;
        constexpr btScalar kUsual = btScalar(1) / 60;
        if (isTwice)
            world().stepSimulation(2 * kUsual, 2, kUsual);
        else
            world().stepSimulation(kUsual, 0, kUsual);
    }
    /// Undoes all edits, and lets all sleep again.
    void finish()
    {
        m_edit = nullptr;
        if (m_moment == EditMoment::Action)
            world().removeAction(&m_action);
        world().setInternalTickCallback(nullptr, this, true);
        world().setInternalTickCallback(nullptr, this, false);
        world().setSynchronizeAllMotionStates(false);
        world().setGravity(vec(0, -10, 0));
        gDisableDeactivation = false;
        m_ownShape->setLocalScaling(vec(1, 1, 1));
        m_moment = EditMoment::BetweenSteps;
        for (std::size_t i = 0; i < bodies().size(); ++i)
            bringHome(*bodies()[i], i == 0, m_home[i]);
    }
    /// Edits of all steps.
    int events() const override { return m_edits; }

private:
    static constexpr int kEdited = 100;

    class MotionState final : public btMotionState
    {
    public:
        explicit MotionState(SleepScene& scene) : m_scene(scene) {}
        void getWorldTransform(btTransform&) const override
        {
            m_scene.editAt(EditMoment::KinematicMotionState);
        }
        void setWorldTransform(const btTransform&) override { m_scene.editAt(EditMoment::Synchronization); }

    private:
        SleepScene& m_scene;
    };
    class Action final : public btActionInterface
    {
    public:
        explicit Action(SleepScene& scene) : m_scene(scene) {}
        void updateAction(btCollisionWorld*, btScalar) override { m_scene.editAt(EditMoment::Action); }
        void debugDraw(btIDebugDraw*) override {}

    private:
        SleepScene& m_scene;
    };

    static void tick(btDynamicsWorld* world, btScalar)
    {
        auto& scene = *static_cast<SleepScene*>(world->getWorldUserInfo());
        const bool isSecond = ++scene.m_ticks == 2;
        if (isSecond == (scene.m_moment == EditMoment::BeforeSecondTick))
            scene.editNow();
    }
    void editAt(EditMoment moment)
    {
        if (moment == m_moment)
            editNow();
    }
    void editNow()
    {
        if (m_edit == nullptr)
            return;
        const SleepEdit& edit = *m_edit;
        m_edit = nullptr;
        ++m_edits;
        edit.run(world(), edited());
    }
    void bringHome(btRigidBody& body, bool isFloor, const btTransform& home)
    {
        body.setMotionState(nullptr);
        body.setCollisionFlags(isFloor ? btCollisionObject::CF_STATIC_OBJECT : 0);
        body.getBroadphaseProxy()->m_collisionFilterMask =
            isFloor ? btBroadphaseProxy::AllFilter ^ btBroadphaseProxy::StaticFilter
                    : btBroadphaseProxy::AllFilter;
        if (!isFloor)
            body.setMassProps(1, vec(1, 1, 1));
        body.setDamping(0, 0);
        body.setCcdMotionThreshold(0);
        body.setWorldTransform(home);
        body.setInterpolationWorldTransform(home);
        body.setLinearVelocity(vec(0, 0, 0));
        body.setAngularVelocity(vec(0, 0, 0));
        body.clearForces();
        body.forceActivationState(ISLAND_SLEEPING);
        body.setDeactivationTime(0);
    }

    btBoxShape* m_ownShape = nullptr;  ///< of the edited body alone
    std::vector<btTransform> m_home;
    MotionState m_state{*this};
    Action m_action{*this};
    const SleepEdit* m_edit = nullptr;  ///< null: made, or none
    EditMoment m_moment = EditMoment::BetweenSteps;
    int m_ticks = 0;
    int m_edits = 0;
};

template <class W, class OfContacts, class OfPairs>
struct SleepStage
{
    btDefaultCollisionConfiguration configuration;
    OfContacts dispatcher{&configuration};
    OfPairs broadphase;
    btSequentialImpulseConstraintSolver solver;
    W world{&dispatcher, &broadphase, &solver, &configuration};
};

struct SleepHistory
{
    std::vector<std::uint64_t> hashes;  ///< after each step
    int edits = 0;
    int stillSteps = 0;  ///< before an edit, in which the loops left out all bodies
    int keptSteps = 0;   ///< and in which no island was searched
    int idleSteps = 0;   ///< and in which no pair was visited
};

constexpr int kStepsPerEdit = 8;

/// Makes each edit at each moment. Before each, all bodies have slept for some steps.
template <class Stage>
SleepHistory runEdits(bool updatesAll)
{
    Stage stage;
    constexpr bool kIsOurs = !std::is_same_v<decltype(stage.world), btDiscreteDynamicsWorld>;
    stage.world.setForceUpdateAllAabbs(updatesAll);
    SleepHistory history;
    SleepScene scene(stage.world);
    const auto step = [&]
    {
        scene.step(0);
        history.hashes.push_back(scene.hash() * 31 + hashOfWorld(stage.world));
    };
    for (int moment = 0; moment < int(EditMoment::All); ++moment)
    {
        for (const SleepEdit& edit : kEdits)
        {
            scene.finish();
            for (int i = 0; i < kStepsPerEdit - 3; ++i)
                step();
            if constexpr (kIsOurs)
            {
                history.stillSteps +=
                    stage.world.bodyStats().restingBodies == std::uint64_t(3 * SleepScene::kPiles);
                history.keptSteps += stage.world.restStats().keptIslands;
                history.idleSteps += stage.world.restStats().leftOutPairs;
            }
            scene.prepare(edit, EditMoment(moment));
            for (int i = 0; i < 3; ++i)
                step();
        }
    }
    history.edits = scene.events();
    return history;
}

template <class Stock, class Own>
SleepHistory expectSameEdits(bool updatesAll)
{
    constexpr int kEachMoment = int(std::size(kEdits)), kAll = kEachMoment * int(EditMoment::All);
    const SleepHistory expected = runEdits<Stock>(updatesAll), own = runEdits<Own>(updatesAll);
    EXPECT_EQ(expected.edits, kAll);
    EXPECT_EQ(own.edits, kAll);
    EXPECT_GT(own.stillSteps, kAll * 9 / 10);
    const auto place = std::mismatch(own.hashes.begin(), own.hashes.end(), expected.hashes.begin()).first -
                       own.hashes.begin();
    const int edit = int(place) / kStepsPerEdit;
    EXPECT_EQ(place, kAll * kStepsPerEdit) << kEdits[edit % kEachMoment].name << " at moment "
                                           << edit / kEachMoment << ", step " << place % kStepsPerEdit;
    return own;
}

class WorldSleep : public testing::TestWithParam<bool>
{
};

INSTANTIATE_TEST_SUITE_P(ForcedUpdates, WorldSleep, testing::Bool(),
                         [](const auto& test) { return test.param ? "On" : "Off"; });

TEST_P(WorldSleep, TakesStepsOfBulletWhenOneBodyIsEdited)
{
    using Stock = SleepStage<btDiscreteDynamicsWorld, Dispatcher, Broadphase>;
    using Own = SleepStage<World<btDiscreteDynamicsWorld>, Dispatcher, Broadphase>;
    const SleepHistory own = expectSameEdits<Stock, Own>(GetParam());
    EXPECT_GT(own.keptSteps, own.edits * 9 / 10);
    EXPECT_GT(own.idleSteps, own.edits * 9 / 10);
}

TEST_P(WorldSleep, TakesStepsOfBulletWhenOneBodyIsEditedInWorldOfDbvt)
{
    using Stock = SleepStage<btDiscreteDynamicsWorld, btCollisionDispatcher, btDbvtBroadphase>;
    using Own = SleepStage<World<btDiscreteDynamicsWorld>, btCollisionDispatcher, btDbvtBroadphase>;
    expectSameEdits<Stock, Own>(GetParam());
}
}  // namespace
}  // namespace cullet::test
