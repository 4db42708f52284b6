// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/scenes/body_world.h"

#include "demos/program/exit_code.h"
#include "plugin/convex_dispatcher.h"

#include <algorithm>
#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr btScalar kSpacing = btScalar(1.3);
constexpr std::uint32_t kLayers = 16;
constexpr btScalar kWall = btScalar(1);

btQuaternion randomRotation(SplitMix64& random)
{
    btQuaternion rotation;
    do
    {
        rotation = btQuaternion(btScalar(random.uniform(-1, 1)), btScalar(random.uniform(-1, 1)),
                                btScalar(random.uniform(-1, 1)), btScalar(random.uniform(-1, 1)));
    } while (rotation.length2() > btScalar(1) || rotation.length2() < btScalar(0.01));
    return rotation.normalize();
}

void hashScalars(std::uint64_t& hash, const btVector3& vector)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        // -0 and 0 are the same place.
        const btScalar value = vector[axis] + btScalar(0);
        const unsigned char* bytes = reinterpret_cast<const unsigned char*>(&value);
        for (std::size_t i = 0; i < sizeof(value); ++i)
            hash = (hash ^ bytes[i]) * 0x100000001b3ull;
    }
}

/// Bodies along each side of a square layer, for a column of at most kLayers layers.
std::uint32_t columnsFor(std::uint32_t bodies)
{
    const double layers =
        std::clamp(std::cbrt(static_cast<double>(bodies)), 1.0, static_cast<double>(kLayers));
    return std::max(1u, static_cast<std::uint32_t>(std::ceil(std::sqrt(bodies / layers))));
}

std::unique_ptr<btCollisionDispatcher> makeDispatcher(const BodyWorldOptions& options,
                                                      btDefaultCollisionConfiguration& configuration)
{
    if (options.narrow == "dispatcher")
    {
        DispatcherOptions own;
        own.threads = options.threads;
        return std::make_unique<Dispatcher>(&configuration, own);
    }
    auto dispatcher = std::make_unique<btCollisionDispatcher>(&configuration);
    if (options.narrow == "isa-gjk")
        registerIsaGjk(*dispatcher);
    else if (options.narrow != "bullet")
        throw ProgramError(kExitUsage, "no narrow phase '" + options.narrow + "'");
    return dispatcher;
}
}  // namespace

const std::vector<std::string>& narrowPhaseNames()
{
    static const std::vector<std::string> names = {"bullet", "isa-gjk", "dispatcher"};
    return names;
}

BodyWorld::BodyWorld(NamedBroadphase broadphase, const BodyShapes& shapes, const BodyWorldOptions& options)
    : m_options(options),
      m_broadphase(std::move(broadphase)),
      m_dispatcher(makeDispatcher(options, m_configuration))
{
    const MarginScope margin(m_broadphase.margin);
    m_world = std::make_unique<btDiscreteDynamicsWorld>(m_dispatcher.get(), m_broadphase.broadphase.get(),
                                                        &m_solver, &m_configuration);
    const std::uint32_t columns = columnsFor(options.bodies);
    const std::uint32_t layers = options.bodies / (columns * columns) + 1;
    addGround(btScalar(columns) * kSpacing / 2 + btScalar(0.5), btScalar(layers + 4) * kSpacing);
    addBodies(shapes);
}

BodyWorld::~BodyWorld()
{
    // Pairs first, from the end of the array: Bullet's cache scans all pairs for each body that goes.
    btOverlappingPairCache& cache = *m_world->getPairCache();
    while (cache.getNumOverlappingPairs() > 0)
    {
        const btBroadphasePair& last = cache.getOverlappingPairArray()[cache.getNumOverlappingPairs() - 1];
        cache.removeOverlappingPair(last.m_pProxy0, last.m_pProxy1, m_dispatcher.get());
    }
    for (const auto& body : m_bodies)
        m_world->removeRigidBody(body.get());
}

void BodyWorld::addGround(btScalar halfWidth, btScalar height)
{
    const btScalar outer = halfWidth + kWall;
    addStaticBox(btVector3(outer, kWall, outer), btVector3(0, -kWall, 0));
    const btVector3 alongX(kWall / 2, height / 2, outer);
    const btVector3 alongZ(outer, height / 2, kWall / 2);
    const btScalar offset = halfWidth + kWall / 2;
    for (const btScalar sign : {btScalar(-1), btScalar(1)})
    {
        addStaticBox(alongX, btVector3(sign * offset, height / 2, 0));
        addStaticBox(alongZ, btVector3(0, height / 2, sign * offset));
    }
}

void BodyWorld::addStaticBox(const btVector3& halfExtents, const btVector3& centre)
{
    m_groundShapes.push_back(std::make_unique<btBoxShape>(halfExtents));
    btTransform transform = btTransform::getIdentity();
    transform.setOrigin(centre);
    btRigidBody::btRigidBodyConstructionInfo info(0, nullptr, m_groundShapes.back().get());
    info.m_startWorldTransform = transform;
    m_bodies.push_back(std::make_unique<btRigidBody>(info));
    m_world->addRigidBody(m_bodies.back().get());
}

void BodyWorld::addBodies(const BodyShapes& shapes)
{
    SplitMix64 random(m_options.seed);
    const std::uint32_t columns = columnsFor(m_options.bodies);
    const btScalar centre = btScalar(columns - 1) / 2;
    for (std::uint32_t i = 0; i < m_options.bodies; ++i)
    {
        const std::uint32_t layer = i / (columns * columns);
        const btVector3 cell(btScalar(i % columns) - centre, btScalar(layer),
                             btScalar(i / columns % columns) - centre);
        const btVector3 shift(btScalar(random.uniform(-0.1f, 0.1f)), 0,
                              btScalar(random.uniform(-0.1f, 0.1f)));
        const btTransform transform(randomRotation(random),
                                    cell * kSpacing + shift + btVector3(0, btScalar(1.2), 0));
        addBody(shapes.at(random.below(shapes.size())), transform);
    }
}

void BodyWorld::addBody(btCollisionShape* shape, const btTransform& transform)
{
    btVector3 inertia;
    shape->calculateLocalInertia(1, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(1, nullptr, shape, inertia);
    info.m_startWorldTransform = transform;
    m_bodies.push_back(std::make_unique<btRigidBody>(info));
    if (!m_options.sleeping)
        m_bodies.back()->setActivationState(DISABLE_DEACTIVATION);
    m_world->addRigidBody(m_bodies.back().get());
}

PhaseTimes BodyWorld::step()
{
    const MarginScope margin(m_broadphase.margin);
    // Zero substeps: exactly one step, of length dt.
    return PhaseClock::measure([this] { m_world->stepSimulation(m_options.dt, 0); });
}

std::uint64_t BodyWorld::pairCount() const
{
    return static_cast<std::uint64_t>(m_world->getPairCache()->getNumOverlappingPairs());
}

std::uint64_t BodyWorld::contactPairCount() const
{
    std::uint64_t count = 0;
    for (int i = 0; i < m_dispatcher->getNumManifolds(); ++i)
        count += m_dispatcher->getManifoldByIndexInternal(i)->getNumContacts() > 0 ? 1 : 0;
    return count;
}

std::uint64_t BodyWorld::stateHash() const
{
    std::uint64_t hash = 0xcbf29ce484222325ull;
    for (const auto& body : m_bodies)
    {
        const btTransform& transform = body->getWorldTransform();
        for (int row = 0; row < 3; ++row)
            hashScalars(hash, transform.getBasis()[row]);
        hashScalars(hash, transform.getOrigin());
    }
    return hash;
}

btScalar BodyWorld::lowestHeight() const
{
    btScalar lowest = BT_LARGE_FLOAT;
    for (const auto& body : m_bodies)
    {
        if (!body->isStaticObject())
            lowest = std::min(lowest, body->getWorldTransform().getOrigin().y());
    }
    return lowest;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
