// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/determinism/history.h"

#include "cullet/plugin/world.h"
#include "cullet/tests/support/number_hash.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <numeric>
#include <utility>

namespace cullet::test
{
namespace
{
constexpr std::uint32_t kSeed = 20261126;
constexpr std::size_t kPoured = 130;
/// World computes boxes on several threads from 512 bodies on, and proxies have more than one block of memory.
constexpr std::size_t kDrifting = 1100;

BroadphaseOptions broadphaseOptions(int threads)
{
    BroadphaseOptions options;
    options.threads = threads;
    return options;
}

DispatcherOptions dispatcherOptions(const HistoryOptions& history)
{
    DispatcherOptions options;
    options.threads = history.threads;
    options.isaGjk.boxPairs =
        history.scene == HistoryScene::Drift ? BoxPairs::IsaGjk : BoxPairs::SeparatingAxes;
    return options;
}

/// Only sums, products, quotients and a root, which IEEE 754 rounds in one way.
btQuaternion drawTurn(Random& random)
{
    const float w = random.between(-1, 1);
    const btVector3 axis = vec(random.point(-1, 1));
    return btQuaternion(axis.x(), axis.y(), axis.z(), btScalar(w)).normalized();
}

std::vector<btVector3> drawCloud(Random& random, int count)
{
    std::vector<btVector3> points;
    for (int i = 0; i < count; ++i)
        points.push_back(vec(random.point(-0.5f, 0.5f)));
    return points;
}

template <class Shape, class... Arguments>
void addShape(std::vector<std::unique_ptr<btCollisionShape>>& shapes, Arguments&&... arguments)
{
    shapes.push_back(std::make_unique<Shape>(std::forward<Arguments>(arguments)...));
}

void addPoint(NumberHash& hash, const btManifoldPoint& point)
{
    hash.add(point.getDistance());
    hash.addVector(point.getPositionWorldOnA());
    hash.addVector(point.getPositionWorldOnB());
    hash.addVector(point.m_normalWorldOnB);
}

void addTransform(NumberHash& hash, const btTransform& transform)
{
    for (int row = 0; row < 3; ++row)
        hash.addVector(transform.getBasis()[row]);
    hash.addVector(transform.getOrigin());
}
}  // namespace

HistoryWorld::HistoryWorld(const HistoryOptions& options) : m_scene(options.scene)
{
    if (options.narrow == Narrow::Dispatcher)
        m_dispatcher = std::make_unique<Dispatcher>(&m_configuration, dispatcherOptions(options));
    else
        m_dispatcher = std::make_unique<btCollisionDispatcher>(&m_configuration);
    if (options.narrow == Narrow::IsaGjk)
        registerIsaGjk(*m_dispatcher, dispatcherOptions(options).isaGjk);
    const BroadphaseOptions broadphase = broadphaseOptions(options.threads);
    if (options.makeBackend)
        m_broadphase =
            std::make_unique<Broadphase>(options.makeBackend(options.threads), nullptr, broadphase);
    else
        m_broadphase = std::make_unique<Broadphase>(broadphase);
    if (options.isParallelWorld)
    {
        auto parallel = std::make_unique<World<btDiscreteDynamicsWorld>>(
            m_dispatcher.get(), m_broadphase.get(), &m_solver, &m_configuration);
        parallel->setUpdateThreads(options.threads);
        m_world = std::move(parallel);
    }
    else
    {
        m_world = std::make_unique<btDiscreteDynamicsWorld>(m_dispatcher.get(), m_broadphase.get(), &m_solver,
                                                            &m_configuration);
    }
    makeShapes();
    makeBodies(options.order);
}

HistoryWorld::~HistoryWorld()
{
    if (m_scene == HistoryScene::Pour)
        m_world->removeCollisionObject(&m_ghost);
    for (const auto& body : m_bodies)
        m_world->removeRigidBody(body.get());
}

void HistoryWorld::makeShapes()
{
    Random random(kSeed);
    m_shapes.push_back(makeHullShape(drawCloud(random, 24)));
    m_shapes.push_back(makeHullShape(drawCloud(random, 9)));
    m_shapes.push_back(makeHullShape(boxPoints(0.4, 0.3, 0.35)));
    addShape<btBoxShape>(m_shapes, vec(0.4, 0.3, 0.5));
    addShape<btSphereShape>(m_shapes, btScalar(0.4));
    addShape<btCapsuleShape>(m_shapes, btScalar(0.25), btScalar(0.5));
    if (m_scene == HistoryScene::Drift)
        return;
    addShape<btCylinderShape>(m_shapes, vec(0.4, 0.3, 0.4));
    auto pair = std::make_unique<btCompoundShape>();
    for (const double x : {-0.3, 0.3})
        pair->addChildShape(btTransform(btQuaternion::getIdentity(), vec(x, 0, 0)), m_shapes[2].get());
    m_shapes.push_back(std::move(pair));
}

void HistoryWorld::makeBodies(const std::vector<std::size_t>& order)
{
    const bool isPour = m_scene == HistoryScene::Pour;
    const std::size_t count = isPour ? kPoured : kDrifting, edge = isPour ? 5 : 9;
    Random random(kSeed + 1);
    std::vector<btTransform> places;
    for (std::size_t i = 0; i < count; ++i)
    {
        const double x = double(i % edge), y = double(i / (edge * edge)), z = double(i / edge % edge);
        const btVector3 at = vec(x, y, z) * btScalar(isPour ? 1.05 : 0.95) + vec(random.point(0, 0.3f));
        places.emplace_back(drawTurn(random), at);
        m_ways.push_back(vec(random.point(-0.04f, 0.04f)));
    }
    m_bodies.resize(count + (isPour ? 1 : 0));
    std::vector<std::size_t> numbers(count);
    std::iota(numbers.begin(), numbers.end(), std::size_t{0});
    for (const std::size_t number : order.empty() ? numbers : order)
        add(number, *m_shapes[number % m_shapes.size()], 1, places[number]);
    if (!isPour)
        return;
    addShape<btBoxShape>(m_shapes, vec(9, 0.5, 9));
    add(count, *m_shapes.back(), 0, btTransform(btQuaternion::getIdentity(), vec(2, -1.5, 2)));
    m_broadphase->getOverlappingPairCache()->setInternalGhostPairCallback(&m_ghostCallback);
    m_ghost.setCollisionShape(&m_zone);
    m_ghost.setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(2, 0.5, 2)));
    m_ghost.setCollisionFlags(btCollisionObject::CF_NO_CONTACT_RESPONSE);
    m_world->addCollisionObject(&m_ghost);
}

void HistoryWorld::add(std::size_t number, btCollisionShape& shape, double mass, const btTransform& at)
{
    btVector3 inertia(0, 0, 0);
    if (mass > 0)
        shape.calculateLocalInertia(btScalar(mass), inertia);
    btRigidBody::btRigidBodyConstructionInfo info(btScalar(mass), nullptr, &shape, inertia);
    info.m_startWorldTransform = at;
    m_bodies[number] = std::make_unique<btRigidBody>(info);
    m_bodies[number]->setUserIndex(static_cast<int>(number));
    m_world->addRigidBody(m_bodies[number].get());
}

void HistoryWorld::step()
{
    if (m_scene == HistoryScene::Pour)
    {
        m_world->stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
        return;
    }
    drift();
    m_world->performDiscreteCollisionDetection();
}

/// Moves and turns every body but each fifth.
void HistoryWorld::drift()
{
    const btQuaternion turn = btQuaternion(btScalar(0.02), btScalar(0.01), btScalar(-0.03), 1).normalized();
    for (std::size_t i = 0; i < m_bodies.size(); ++i)
    {
        if (i % 5 == 4)
            continue;
        btTransform& at = m_bodies[i]->getWorldTransform();
        at.setOrigin(at.getOrigin() + m_ways[i]);
        at.setBasis(btMatrix3x3(turn) * at.getBasis());
    }
}

int HistoryWorld::contacts() const
{
    int count = 0;
    for (int i = 0; i < m_dispatcher->getNumManifolds(); ++i)
        count += m_dispatcher->getManifoldByIndexInternal(i)->getNumContacts();
    return count;
}

int HistoryWorld::pairs() const
{
    return m_world->getPairCache()->getNumOverlappingPairs();
}

Fingerprint HistoryWorld::fingerprint() const
{
    NumberHash pairs, contacts, bodies;
    const btBroadphasePairArray& array = m_world->getPairCache()->getOverlappingPairArray();
    for (int i = 0; i < array.size(); ++i)
    {
        pairs.add(array[i].m_pProxy0->m_uniqueId);
        pairs.add(array[i].m_pProxy1->m_uniqueId);
    }
    const auto& guests = const_cast<btPairCachingGhostObject&>(m_ghost).getOverlappingPairs();
    for (int i = 0; i < guests.size(); ++i)
        pairs.add(guests[i]->getUserIndex());
    for (int i = 0; i < m_dispatcher->getNumManifolds(); ++i)
    {
        const btPersistentManifold& manifold = *m_dispatcher->getManifoldByIndexInternal(i);
        contacts.add(manifold.getBody0()->getUserIndex());
        contacts.add(manifold.getBody1()->getUserIndex());
        for (int k = 0; k < manifold.getNumContacts(); ++k)
            addPoint(contacts, manifold.getContactPoint(k));
    }
    for (const auto& body : m_bodies)
    {
        bodies.addVector(body->getBroadphaseProxy()->m_aabbMin);
        bodies.addVector(body->getBroadphaseProxy()->m_aabbMax);
        addTransform(bodies, body->getWorldTransform());
        bodies.addVector(body->getLinearVelocity());
        bodies.addVector(body->getAngularVelocity());
        bodies.add(body->getActivationState());
    }
    return {pairs.value(), contacts.value(), bodies.value()};
}

History HistoryWorld::run(int steps)
{
    History history;
    for (int i = 0; i < steps; ++i)
    {
        step();
        history.push_back(fingerprint());
    }
    return history;
}

int stepsOf(HistoryScene scene)
{
    return scene == HistoryScene::Pour ? 60 : 12;
}

History historyOf(const HistoryOptions& options)
{
    HistoryWorld world(options);
    History history = world.run(stepsOf(options.scene));
    EXPECT_GT(world.pairs(), 300) << "hardly any pairs";
    EXPECT_GT(world.contacts(), 200) << "hardly any contacts";
    EXPECT_NE(history.front().pairs, history.back().pairs);
    EXPECT_NE(history.front().contacts, history.back().contacts);
    EXPECT_NE(history.front().bodies, history.back().bodies);
    return history;
}
}  // namespace cullet::test
