// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/world/step_scene.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletDynamics/Character/btKinematicCharacterController.h>

#include <algorithm>

namespace cullet::test
{
namespace
{
/// Fast balls with CCD thresholds among slow ones, and thin walls.
class Bullets : public StepScene
{
public:
    explicit Bullets(btDiscreteDynamicsWorld& world) : StepScene(world)
    {
        addFloor();
        makeGroupsSmall();
        btBoxShape& wall = makeShape<btBoxShape>(vec(3, 3, 0.02));
        btSphereShape& ball = makeShape<btSphereShape>(btScalar(0.1));
        btBoxShape& box = makeShape<btBoxShape>(vec(0.5, 0.5, 0.5));
        for (int i = 0; i < 12; ++i)
        {
            addBody(wall, i % 3 == 0 ? 5 : 0, vec(7 * i - 40, 3.05, 5));
            addBody(box, 1, vec(7 * i - 40, 0.55, 2));
            for (int j = 0; j < 3; ++j)
                addBullet(ball, vec(7 * i - 40 + j, 1 + j, -5 - 3 * j));
        }
    }
    void step(int number) override
    {
        if (number % 50 == 0)
        {
            // A threshold that comes and goes: the loops without any are other ones.
            for (btRigidBody* ball : m_balls)
                ball->setCcdMotionThreshold(number % 200 == 150 ? btScalar(0) : btScalar(0.05));
            fire();
        }
        StepScene::step(number);
        for (const btRigidBody* ball : m_balls)
            m_clamped += ball->getHitFraction() != 1;
    }
    int events() const override { return m_clamped; }

private:
    void addBullet(btCollisionShape& shape, const btVector3& at)
    {
        btRigidBody& ball = addBody(shape, 0.2, at);
        ball.setCcdSweptSphereRadius(btScalar(0.05));
        m_balls.push_back(&ball);
    }
    void fire()
    {
        for (btRigidBody* ball : m_balls)
        {
            ball->setLinearVelocity(vec(0, 0, 60));
            ball->activate();
        }
    }

    std::vector<btRigidBody*> m_balls;
    int m_clamped = 0;
};

class BulletsWithRestitution : public Bullets
{
public:
    explicit BulletsWithRestitution(btDiscreteDynamicsWorld& world) : Bullets(world)
    {
        world.setApplySpeculativeContactRestitution(true);
        for (const auto& body : bodies())
            body->setRestitution(btScalar(0.5));
    }
};

/// Vehicles and characters, which are actions of the world, among boxes.
class Actors : public StepScene
{
public:
    explicit Actors(btDiscreteDynamicsWorld& world) : StepScene(world)
    {
        addFloor();
        makeGroupsSmall();
        world.getPairCache()->setInternalGhostPairCallback(&m_ghostPairs);
        btBoxShape& box = makeShape<btBoxShape>(vec(0.4, 0.4, 0.4));
        for (int i = 0; i < 60; ++i)
            addBody(box, 1, vec(3 * (i % 10) - 15, 0.45, 3 * (i / 10) - 8));
        for (int i = 0; i < 3; ++i)
        {
            addVehicle(vec(8 * i - 8, 1.1, -15));
            addCharacter(vec(6 * i - 9, 1.5, 14));
        }
    }
    ~Actors() override
    {
        for (auto& action : m_actions)
            world().removeAction(action.get());
        for (auto& ghost : m_ghosts)
            world().removeCollisionObject(ghost.get());
        // The bodies outlive the callback.
        world().getPairCache()->setInternalGhostPairCallback(nullptr);
    }
    void step(int number) override
    {
        for (btRaycastVehicle* vehicle : m_vehicles)
        {
            vehicle->applyEngineForce(number < 200 ? 1500 : 0, 2);
            vehicle->applyEngineForce(number < 200 ? 1500 : 0, 3);
            vehicle->setSteeringValue(btScalar(number % 100 < 50 ? 0.2 : -0.2), 0);
        }
        for (btKinematicCharacterController* character : m_characters)
            character->setWalkDirection(vec(0.01, 0, number % 300 < 150 ? -0.06 : 0.06));
        StepScene::step(number);
    }
    int events() const override
    {
        return static_cast<int>(
            std::count_if(m_vehicles.begin(), m_vehicles.end(),
                          [](const btRaycastVehicle* vehicle)
                          { return vehicle->getRigidBody()->getCenterOfMassPosition().z() > -10; }));
    }

private:
    template <class Action, class... Args>
    Action& addAction(Args&&... args)
    {
        auto action = std::make_unique<Action>(std::forward<Args>(args)...);
        Action& made = *action;
        m_actions.push_back(std::move(action));
        world().addAction(&made);
        return made;
    }
    void addVehicle(const btVector3& at)
    {
        btRigidBody& chassis = addBody(makeShape<btBoxShape>(vec(1, 0.4, 2)), 800, at);
        chassis.setActivationState(DISABLE_DEACTIVATION);
        const btRaycastVehicle::btVehicleTuning tuning;
        auto& vehicle = addAction<btRaycastVehicle>(tuning, &chassis, &m_raycaster);
        vehicle.setCoordinateSystem(0, 1, 2);
        for (int i = 0; i < 4; ++i)
            vehicle.addWheel(vec(i % 2 ? 0.9 : -0.9, -0.2, i < 2 ? 1.5 : -1.5), vec(0, -1, 0), vec(-1, 0, 0),
                             btScalar(0.6), btScalar(0.4), tuning, i < 2);
        m_vehicles.push_back(&vehicle);
    }
    void addCharacter(const btVector3& at)
    {
        auto& capsule = makeShape<btCapsuleShape>(btScalar(0.4), btScalar(1));
        m_ghosts.push_back(std::make_unique<btPairCachingGhostObject>());
        btPairCachingGhostObject& ghost = *m_ghosts.back();
        ghost.setCollisionShape(&capsule);
        ghost.setCollisionFlags(btCollisionObject::CF_CHARACTER_OBJECT);
        ghost.setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
        world().addCollisionObject(&ghost, btBroadphaseProxy::CharacterFilter,
                                   btBroadphaseProxy::StaticFilter | btBroadphaseProxy::DefaultFilter);
        m_characters.push_back(
            &addAction<btKinematicCharacterController>(&ghost, &capsule, btScalar(0.3), vec(0, 1, 0)));
    }

    btGhostPairCallback m_ghostPairs;
    btDefaultVehicleRaycaster m_raycaster{&world()};
    std::vector<std::unique_ptr<btActionInterface>> m_actions;
    std::vector<std::unique_ptr<btPairCachingGhostObject>> m_ghosts;
    std::vector<btRaycastVehicle*> m_vehicles;
    std::vector<btKinematicCharacterController*> m_characters;
};

/// Bodies and joints come and go between steps and in tick callbacks; a contact callback wakes, and one changes friction.
class Churn : public StepScene
{
public:
    explicit Churn(btDiscreteDynamicsWorld& world) : StepScene(world), m_random(5)
    {
        addFloor();
        makeGroupsSmall();
        m_box = &makeShape<btBoxShape>(vec(0.4, 0.4, 0.4));
        for (int i = 0; i < 60; ++i)
            drop();
        world.setInternalTickCallback([](btDynamicsWorld* ticking, btScalar) { self(*ticking).churn(); },
                                      this, true);
        world.setInternalTickCallback([](btDynamicsWorld* ticking, btScalar) { self(*ticking).wakeSome(); },
                                      this, false);
        gContactProcessedCallback = [](btManifoldPoint& point, void* a, void* b)
        {
            static_cast<btCollisionObject*>(a)->activate();
            static_cast<btCollisionObject*>(b)->setDeactivationTime(0);
            point.m_combinedFriction = btScalar(0.7);
            return true;
        };
    }
    ~Churn() override { gContactProcessedCallback = nullptr; }
    int events() const override { return m_events; }

private:
    static Churn& self(btDynamicsWorld& world) { return *static_cast<Churn*>(world.getWorldUserInfo()); }
    void drop()
    {
        btRigidBody& body = addBody(*m_box, 1, vec(m_random.point(-8, 8)) + vec(0, 12, 0));
        body.setLinearVelocity(vec(m_random.point(-1, 1)));
        const std::size_t count = bodies().size();
        if (count > 3 && m_random.chance(0.3f))
            addJoint<btPoint2PointConstraint>(body, *bodies()[count - 2], vec(0.6, 0, 0), vec(-0.6, 0, 0))
                .setBreakingImpulseThreshold(3);
    }
    void churn()
    {
        ++m_ticks;
        if (m_ticks % 7 == 0)
            drop();
        if (m_ticks % 9 == 0 && joints().size() > 2)
            removeJoint(*joints()[m_random.below(std::uint32_t(joints().size()))]);
        if (m_ticks % 11 == 0)
            removeFreeBody();
    }
    void removeFreeBody()
    {
        for (std::size_t i = 1; i < bodies().size(); ++i)
        {
            if (bodies()[i]->getNumConstraintRefs() > 0)
                continue;
            removeBody(*bodies()[i]);
            ++m_events;
            return;
        }
    }
    void wakeSome()
    {
        btRigidBody& body = *bodies()[m_random.below(std::uint32_t(bodies().size()))];
        if (m_ticks % 5 == 0)
            body.activate(true);
        if (m_ticks % 13 == 0)
            body.applyCentralImpulse(vec(0, 2, 0));
        if (m_ticks % 17 == 0)
            body.forceActivationState(m_ticks % 2 == 0 ? DISABLE_SIMULATION : ACTIVE_TAG);
    }

    Random m_random;
    btCollisionShape* m_box = nullptr;
    int m_ticks = 0, m_events = 0;
};

/// Motion states of the application, which see each call in order; and substeps.
class MotionStates : public StepScene
{
    class State : public btMotionState
    {
    public:
        State(std::uint64_t& calls, const btVector3& at) : m_calls(calls), m_at(at) {}
        void getWorldTransform(btTransform& transform) const override
        {
            note(transform.getOrigin().x());
            transform = btTransform(btQuaternion::getIdentity(), m_at);
        }
        void setWorldTransform(const btTransform& transform) override { note(transform.getOrigin().y()); }
        btVector3& at() { return m_at; }

    private:
        void note(btScalar value) const
        {
            m_calls = (m_calls ^ std::uint64_t(double(value) * 1e6)) * 1099511628211ull;
        }
        std::uint64_t& m_calls;
        btVector3 m_at;
    };

public:
    explicit MotionStates(btDiscreteDynamicsWorld& world) : StepScene(world)
    {
        addFloor();
        makeGroupsSmall();
        btBoxShape& box = makeShape<btBoxShape>(vec(0.5, 0.5, 0.5));
        for (int i = 0; i < 60; ++i)
        {
            const btVector3 at = vec(3 * (i % 10), 0.6 + i % 4, 3 * (i / 10));
            m_states.push_back(std::make_unique<State>(m_calls, at));
            btRigidBody& body = addBody(box, i % 9 == 0 ? 0 : 1, at, m_states.back().get());
            if (i % 9 == 0)
                body.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
            if (i % 9 == 0)
                body.setActivationState(DISABLE_DEACTIVATION);
        }
    }
    void step(int number) override
    {
        for (std::size_t i = 0; i < m_states.size(); i += 9)
            m_states[i]->at() += vec(0, 0, number % 80 < 40 ? 0.01 : -0.01);
        world().stepSimulation(btScalar(0.03), 4, btScalar(1) / 100);
        // The calls become a part of the hash.
        bodies()[1]->setHitFraction(btScalar(m_calls % 1000003));
    }
    int events() const override { return m_calls != 1; }

private:
    std::uint64_t m_calls = 1;
    std::vector<std::unique_ptr<State>> m_states;
};
}  // namespace

std::vector<NamedScene> actorScenes()
{
    return {{"Bullets", makeScene<Bullets>},
            {"BulletsWithRestitution", makeScene<BulletsWithRestitution>},
            {"Actors", makeScene<Actors>},
            {"Churn", makeScene<Churn>},
            {"MotionStates", makeScene<MotionStates>}};
}
}  // namespace cullet::test
