// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/convex/convex_world.h"

#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace cullet::test
{
/// The state of all bodies at the start of a step.
using Moment = std::vector<std::vector<btScalar>>;
/// One moment for each step.
using Future = std::vector<Moment>;

/// The first difference of two futures; empty if they are bitwise equal.
inline std::string firstDifference(const Future& expected, const Future& actual)
{
    if (expected.size() != actual.size())
        return "other steps";
    std::ostringstream text;
    text.precision(std::numeric_limits<btScalar>::max_digits10);
    for (std::size_t step = 0; step < expected.size(); ++step)
    {
        for (std::size_t body = 0; body < expected[step].size(); ++body)
        {
            const std::vector<btScalar>&a = expected[step][body], &b = actual[step][body];
            for (std::size_t i = 0; i < a.size(); ++i)
            {
                if (std::memcmp(&a[i], &b[i], sizeof(btScalar)) == 0)
                    continue;
                text << "step " << step << ", body " << body << ", number " << i << ": " << a[i] << " became "
                     << b[i];
                return text.str();
            }
        }
    }
    return "";
}

/// Bullet sorts manifolds by their bodies, and those of the children of two compounds in the order of creation. This
/// world sorts them by the children.
class SortingWorld : public btMultiBodyDynamicsWorld
{
public:
    using btMultiBodyDynamicsWorld::btMultiBodyDynamicsWorld;

    /// Keeps the order of the manifolds for the solver.
    void sortManifolds()
    {
        m_sorts = true;
        getSimulationIslandManager()->setSplitIslands(false);
    }

private:
    void calculateSimulationIslands() override
    {
        if (m_sorts && m_dispatcher1->getNumManifolds() > 0)
            sort(m_dispatcher1->getInternalManifoldPointer(), m_dispatcher1->getNumManifolds());
        btMultiBodyDynamicsWorld::calculateSimulationIslands();
    }

    static void sort(btPersistentManifold** manifolds, int count)
    {
        std::stable_sort(manifolds, manifolds + count,
                         [](btPersistentManifold* a, btPersistentManifold* b)
                         { return keyOf(*a) < keyOf(*b); });
        for (int i = 0; i < count; ++i)
            manifolds[i]->m_index1a = i;
    }

    static std::array<int, 4> keyOf(const btPersistentManifold& manifold)
    {
        std::array<int, 4> key = {manifold.getBody0()->getBroadphaseHandle()->m_uniqueId,
                                  manifold.getBody1()->getBroadphaseHandle()->m_uniqueId, -1, -1};
        if (manifold.getNumContacts() > 0)
        {
            key[2] = manifold.getContactPoint(0).m_index0;
            key[3] = manifold.getContactPoint(0).m_index1;
        }
        return key;
    }

    bool m_sorts = false;
};

/// A world of rigid bodies and multibodies with a selectable narrow phase, which can be restored to an earlier moment.
///
/// Other dependencies of a step are removed: pairs are those of the currently overlapping boxes, and manifolds are
/// sorted.
class SavedWorld
{
public:
    explicit SavedWorld(Narrow narrow)
        : m_dispatcher(makeDispatcher(narrow)),
          m_broadphase(nullptr, broadphaseOptions()),
          world(m_dispatcher.get(), &m_broadphase, &m_solver, &m_configuration)
    {
        if (narrow == Narrow::IsaGjk)
            m_registration = &registerIsaGjk(*m_dispatcher);
        world.getDispatchInfo().m_deterministicOverlappingPairs = true;
        world.setGravity(vec(0, -10, 0));
    }
    ~SavedWorld()
    {
        for (const auto& constraint : m_constraints)
            world.removeConstraint(constraint.get());
        for (const auto& robot : m_robots)
            world.removeMultiBody(robot.get());
        for (const auto& collider : m_colliders)
            world.removeCollisionObject(collider.get());
        for (const auto& body : bodies)
            world.removeRigidBody(body.get());
    }
    SavedWorld(const SavedWorld&) = delete;
    SavedWorld& operator=(const SavedWorld&) = delete;

    /// @param mass 0: static
    btRigidBody& add(btCollisionShape& shape, double mass, const btTransform& at)
    {
        btVector3 inertia(0, 0, 0);
        if (mass > 0)
            shape.calculateLocalInertia(btScalar(mass), inertia);
        btRigidBody::btRigidBodyConstructionInfo info(btScalar(mass), nullptr, &shape, inertia);
        info.m_startWorldTransform = at;
        bodies.push_back(std::make_unique<btRigidBody>(info));
        world.addRigidBody(bodies.back().get());
        return *bodies.back();
    }
    btRigidBody& add(btCollisionShape& shape, double mass, const btVector3& at)
    {
        return add(shape, mass, btTransform(btQuaternion::getIdentity(), at));
    }

    template <class Constraint, class... Arguments>
    Constraint& join(Arguments&&... arguments)
    {
        auto made = std::make_unique<Constraint>(std::forward<Arguments>(arguments)...);
        Constraint& constraint = *made;
        m_constraints.push_back(std::move(made));
        world.addConstraint(&constraint, true);
        return constraint;
    }

    /// A chain with a hinge before each link.
    ///
    /// @param shapes of the base and of the links, each 1 wide
    btMultiBody& addChain(const std::vector<btCollisionShape*>& shapes, const btTransform& at)
    {
        const auto inertiaOf = [](btCollisionShape& shape)
        {
            btVector3 inertia;
            shape.calculateLocalInertia(1, inertia);
            return inertia;
        };
        const int links = static_cast<int>(shapes.size()) - 1;
        m_robots.push_back(
            std::make_unique<btMultiBody>(links, btScalar(1), inertiaOf(*shapes[0]), false, false));
        btMultiBody& robot = *m_robots.back();
        for (int i = 0; i < links; ++i)
            robot.setupRevolute(i, 1, inertiaOf(*shapes[std::size_t(i) + 1]), i - 1,
                                btQuaternion::getIdentity(), i % 2 == 0 ? vec(0, 0, 1) : vec(0, 1, 0),
                                vec(0.6, 0, 0), vec(0.6, 0, 0), true);
        robot.finalizeMultiDof();
        robot.setBaseWorldTransform(at);
        for (int link = -1; link < links; ++link)
            addCollider(robot, link, *shapes[static_cast<std::size_t>(link + 1)]);
        world.addMultiBody(&robot);
        place(robot);
        return robot;
    }

    void step() { world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60); }
    Future run(int steps)
    {
        Future future;
        for (int i = 0; i < steps; ++i)
        {
            step();
            future.push_back(now());
        }
        return future;
    }

    Moment now() const
    {
        Moment moment;
        for (const auto& body : bodies)
            moment.push_back(numbersOf(*body));
        for (const auto& robot : m_robots)
            moment.push_back(numbersOf(*robot));
        return moment;
    }

    /// Restores all bodies; contact points are the caller's responsibility.
    void restore(const Moment& moment)
    {
        std::size_t i = 0;
        for (const auto& body : bodies)
            restore(*body, moment[i++]);
        for (const auto& robot : m_robots)
            restore(*robot, moment[i++]);
    }

    void forgetContacts()
    {
        for (int i = 0; i < m_dispatcher->getNumManifolds(); ++i)
            m_dispatcher->getManifoldByIndexInternal(i)->clearManifold();
    }

    int contacts() const
    {
        int count = 0;
        for (int i = 0; i < m_dispatcher->getNumManifolds(); ++i)
            count += m_dispatcher->getManifoldByIndexInternal(i)->getNumContacts();
        return count;
    }

    /// Contact queries that cullet has answered; 0 with Bullet's narrow phase.
    std::uint64_t touchingTotal() const
    {
        const auto* own = dynamic_cast<const Dispatcher*>(m_dispatcher.get());
        if (own != nullptr)
            return own->stats().touchingTotal;
        return m_registration == nullptr ? 0 : m_registration->stats().touchingTotal;
    }

private:
    btDefaultCollisionConfiguration m_configuration;
    std::unique_ptr<btCollisionDispatcher> m_dispatcher;
    Broadphase m_broadphase;
    btMultiBodyConstraintSolver m_solver;
    IsaGjkRegistration* m_registration = nullptr;

public:
    SortingWorld world;
    std::vector<std::unique_ptr<btRigidBody>> bodies;

private:
    std::vector<std::unique_ptr<btTypedConstraint>> m_constraints;
    std::vector<std::unique_ptr<btMultiBody>> m_robots;
    std::vector<std::unique_ptr<btMultiBodyLinkCollider>> m_colliders;

    std::unique_ptr<btCollisionDispatcher> makeDispatcher(Narrow narrow)
    {
        if (narrow != Narrow::Dispatcher)
            return std::make_unique<btCollisionDispatcher>(&m_configuration);
        DispatcherOptions options;
        options.threads = 1;
        return std::make_unique<Dispatcher>(&m_configuration, options);
    }

    static BroadphaseOptions broadphaseOptions()
    {
        BroadphaseOptions options;
        options.threads = 1;
        options.margin = 0;
        return options;
    }

    void addCollider(btMultiBody& robot, int link, btCollisionShape& shape)
    {
        m_colliders.push_back(std::make_unique<btMultiBodyLinkCollider>(&robot, link));
        btMultiBodyLinkCollider& collider = *m_colliders.back();
        collider.setCollisionShape(&shape);
        if (link < 0)
            robot.setBaseCollider(&collider);
        else
            robot.getLink(link).m_collider = &collider;
        world.addCollisionObject(&collider, btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter);
    }

    /// Moves colliders to their links.
    static void place(btMultiBody& robot)
    {
        btAlignedObjectArray<btQuaternion> rotations;
        btAlignedObjectArray<btVector3> origins;
        robot.forwardKinematics(rotations, origins);
        robot.updateCollisionObjectWorldTransforms(rotations, origins);
    }

    // One template visits all numbers in a fixed order, for writing and reading.

    template <class Numbers>
    static void put(Numbers& numbers, const btVector3& vector)
    {
        numbers.insert(numbers.end(), {vector.x(), vector.y(), vector.z()});
    }
    template <class Numbers>
    static void put(Numbers& numbers, const btTransform& transform)
    {
        for (int row = 0; row < 3; ++row)
            put(numbers, transform.getBasis()[row]);
        put(numbers, transform.getOrigin());
    }

    class Reader
    {
    public:
        explicit Reader(const std::vector<btScalar>& numbers) : m_next(numbers.data()) {}
        btScalar number() { return *m_next++; }
        btVector3 vector()
        {
            const btScalar x = number(), y = number(), z = number();
            return {x, y, z};
        }
        btTransform transform()
        {
            btTransform made;
            for (int row = 0; row < 3; ++row)
                made.getBasis()[row] = vector();
            made.setOrigin(vector());
            return made;
        }

    private:
        const btScalar* m_next;
    };

    static std::vector<btScalar> numbersOf(const btRigidBody& body)
    {
        std::vector<btScalar> numbers;
        put(numbers, body.getWorldTransform());
        put(numbers, body.getInterpolationWorldTransform());
        put(numbers, body.getLinearVelocity());
        put(numbers, body.getAngularVelocity());
        put(numbers, body.getInterpolationLinearVelocity());
        put(numbers, body.getInterpolationAngularVelocity());
        numbers.insert(numbers.end(), {btScalar(body.getActivationState()), body.getDeactivationTime(),
                                       body.getHitFraction()});
        return numbers;
    }

    static void restore(btRigidBody& body, const std::vector<btScalar>& numbers)
    {
        Reader from(numbers);
        // Also updates the inertia for the rotation.
        body.setCenterOfMassTransform(from.transform());
        body.setInterpolationWorldTransform(from.transform());
        body.setLinearVelocity(from.vector());
        body.setAngularVelocity(from.vector());
        body.setInterpolationLinearVelocity(from.vector());
        body.setInterpolationAngularVelocity(from.vector());
        body.forceActivationState(static_cast<int>(from.number()));
        body.setDeactivationTime(from.number());
        body.setHitFraction(from.number());
    }

    static std::vector<btScalar> numbersOf(const btMultiBody& robot)
    {
        std::vector<btScalar> numbers;
        put(numbers, robot.getBasePos());
        const btQuaternion& rotation = robot.getWorldToBaseRot();
        numbers.insert(numbers.end(), {rotation.x(), rotation.y(), rotation.z(), rotation.w()});
        put(numbers, robot.getBaseVel());
        put(numbers, robot.getBaseOmega());
        for (int link = 0; link < robot.getNumLinks(); ++link)
            numbers.insert(numbers.end(), {robot.getJointPos(link), robot.getJointVel(link)});
        return numbers;
    }

    static void restore(btMultiBody& robot, const std::vector<btScalar>& numbers)
    {
        Reader from(numbers);
        robot.setBasePos(from.vector());
        const btVector3 rotation = from.vector();
        robot.setWorldToBaseRot({rotation.x(), rotation.y(), rotation.z(), from.number()});
        robot.setBaseVel(from.vector());
        robot.setBaseOmega(from.vector());
        for (int link = 0; link < robot.getNumLinks(); ++link)
        {
            robot.setJointPos(link, from.number());
            robot.setJointVel(link, from.number());
        }
        place(robot);
    }
};
}  // namespace cullet::test
