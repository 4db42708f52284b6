// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/bodies/world_scene.h"

#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/scenes/bodies/mt_world.h"
#include "cullet/demos/scenes/bodies/parallel_world.h"
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/solver.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>

#include <algorithm>
#include <thread>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
std::unique_ptr<btCollisionDispatcher> makeDispatcher(const WorldSceneOptions& options,
                                                      btDefaultCollisionConfiguration& configuration)
{
    if (options.isMt)
        return makeMtDispatcher(configuration, options.threads);
    if (options.narrow == "dispatcher")
    {
        DispatcherOptions own;
        own.threads = options.threads;
        own.isaGjk.activeEdges = options.activeEdges;
        own.isaGjk.reusePose.distance = static_cast<btScalar>(options.reuse);
        return std::make_unique<Dispatcher>(&configuration, own);
    }
    auto dispatcher = std::make_unique<btCollisionDispatcher>(&configuration);
    IsaGjkOptions isaGjk;
    const bool isNamed = options.narrow == "active-edges";
    isaGjk.activeEdges = isNamed || options.activeEdges;
    isaGjk.reusePose.distance = static_cast<btScalar>(options.reuse);
    if (options.narrow == "isa-gjk" || isNamed)
        registerIsaGjk(*dispatcher, isaGjk);
    else if (options.narrow != "bullet")
        throw ProgramError(kExitUsage, "no narrow phase '" + options.narrow + "'");
    return dispatcher;
}

/// @param kind of the world, which has a solver class of its own if it is not rigidWorld()
std::unique_ptr<btConstraintSolver> makeSolverFor(const WorldKind& kind, const WorldSceneOptions& options)
{
    if (options.solver == "bullet")
        return kind.makeSolver();
    if (&kind != &rigidWorld())
        throw ProgramError(kExitUnavailable, "solver '" + options.solver + "': rigid bodies only");
    SolverOptions own;
    own.threads = options.threads;
    if (options.solver == "cullet-soft")
        own.model = SolverModel::Soft;
    else if (options.solver != "cullet")
        throw ProgramError(kExitUsage, "no solver '" + options.solver + "'");
    return std::make_unique<Solver>(own);
}

std::unique_ptr<btDiscreteDynamicsWorld> makeWorld(const WorldKind& kind, const WorldSceneOptions& options,
                                                   btDispatcher& dispatcher,
                                                   btBroadphaseInterface& broadphase,
                                                   btConstraintSolver& solver,
                                                   btCollisionConfiguration& configuration)
{
    if (options.update == "bullet" && !options.isMt)
        return kind.makeWorld(dispatcher, broadphase, solver, configuration);
    if (options.update != "parallel" && !options.isMt)
        throw ProgramError(kExitUsage, "no update of boxes '" + options.update + "'");
    return kind.makeParallelWorld(dispatcher, broadphase, solver, configuration, options.threads);
}

/// The classes for a scene that asks for `kind`.
const WorldKind& kindFor(const WorldKind& kind, const WorldSceneOptions& options)
{
    if (!options.isMt)
        return kind;
    if (&kind != &rigidWorld())
        throw ProgramError(kExitUnavailable, "Bullet's multithreaded world has rigid bodies only");
    return mtWorld();
}
}  // namespace

const std::vector<std::string>& boxUpdateNames()
{
    static const std::vector<std::string> names = {"bullet", "parallel"};
    return names;
}

const std::vector<std::string>& narrowPhaseNames()
{
    static const std::vector<std::string> names = {"bullet", "isa-gjk", "dispatcher", "active-edges"};
    return names;
}

const std::vector<std::string>& solverNames()
{
    static const std::vector<std::string> names = {"bullet", "cullet", "cullet-soft"};
    return names;
}

const WorldKind& rigidWorld()
{
    static const WorldKind kind = {[] { return std::make_unique<btDefaultCollisionConfiguration>(); },
                                   makeSolver<btSequentialImpulseConstraintSolver>,
                                   [](btDispatcher& dispatcher, btBroadphaseInterface& broadphase,
                                      btConstraintSolver& solver, btCollisionConfiguration& configuration) {
                                       return std::make_unique<btDiscreteDynamicsWorld>(
                                           &dispatcher, &broadphase, &solver, &configuration);
                                   },
                                   makeParallelWorld<btDiscreteDynamicsWorld>};
    return kind;
}

void hashScalars(std::uint64_t& hash, const btVector3& vector)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        // Makes -0 equal to 0.
        const btScalar value = vector[axis] + btScalar(0);
        const unsigned char* bytes = reinterpret_cast<const unsigned char*>(&value);
        for (std::size_t i = 0; i < sizeof(value); ++i)
            hash = (hash ^ bytes[i]) * 0x100000001b3ull;
    }
}

btTransform transformAt(const btVector3& origin)
{
    return btTransform(btQuaternion::getIdentity(), origin);
}

void restart(btRigidBody& body, const btTransform& at, const btVector3& velocity)
{
    body.setWorldTransform(at);
    body.setInterpolationWorldTransform(at);
    body.setLinearVelocity(velocity);
    body.setAngularVelocity(btVector3(0, 0, 0));
}

WorldScene::WorldScene(std::string name, NamedBroadphase broadphase, const WorldSceneOptions& options,
                       const WorldKind& kind)
    : m_name(std::move(name)),
      m_options(options),
      m_broadphase(std::move(broadphase)),
      m_configuration(kindFor(kind, options).makeConfiguration()),
      m_dispatcher(makeDispatcher(options, *m_configuration)),
      m_solver(makeSolverFor(kindFor(kind, options), options))
{
    const MarginScope margin(m_broadphase.margin);
    m_world = makeWorld(kindFor(kind, options), options, *m_dispatcher, *m_broadphase.broadphase, *m_solver,
                        *m_configuration);
}

WorldScene::~WorldScene()
{
    // Pairs first, from the end of the array: Bullet's cache scans all pairs for each body that is removed.
    btOverlappingPairCache& cache = *m_world->getPairCache();
    while (cache.getNumOverlappingPairs() > 0)
    {
        const btBroadphasePair& last = cache.getOverlappingPairArray()[cache.getNumOverlappingPairs() - 1];
        cache.removeOverlappingPair(last.m_pProxy0, last.m_pProxy1, m_dispatcher.get());
    }
    while (m_world->getNumConstraints() > 0)
        m_world->removeConstraint(m_world->getConstraint(m_world->getNumConstraints() - 1));
    // From the front: the world searches the object from there, and moves the last one into its place.
    const btCollisionObjectArray& objects = m_world->getCollisionObjectArray();
    while (objects.size() > 0)
        m_world->removeCollisionObject(objects[0]);
}

btRigidBody& WorldScene::addBody(btCollisionShape& shape, btScalar mass, const btTransform& transform)
{
    btVector3 inertia(0, 0, 0);
    if (mass > 0)
        shape.calculateLocalInertia(mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, &shape, inertia);
    info.m_startWorldTransform = transform;
    btRigidBody& body = keep(std::make_unique<btRigidBody>(info));
    if (mass > 0 && !m_options.sleeping)
        body.setActivationState(DISABLE_DEACTIVATION);
    const MarginScope margin(m_broadphase.margin);
    m_world->addRigidBody(&body);
    return body;
}

btRigidBody& WorldScene::addStaticBox(const btVector3& halfExtents, const btVector3& centre)
{
    return addBody(makeShape<btBoxShape>(halfExtents), 0, transformAt(centre));
}

void WorldScene::addWalledFloor(btScalar halfWidth, btScalar height)
{
    constexpr btScalar kWall = 1;
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

btRigidBody& WorldScene::addFloor()
{
    return addBody(makeShape<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)), 0,
                   btTransform::getIdentity());
}

btCollisionObject& WorldScene::addObject(btCollisionShape& shape, const btTransform& transform)
{
    btCollisionObject& object = keep(std::make_unique<btCollisionObject>());
    object.setCollisionShape(&shape);
    object.setWorldTransform(transform);
    // Neither static nor kinematic, since two such objects form no pair.
    object.setCollisionFlags(btCollisionObject::CF_NO_CONTACT_RESPONSE);
    const MarginScope margin(m_broadphase.margin);
    m_world->addCollisionObject(&object, btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter);
    return object;
}

void WorldScene::allowGhosts()
{
    m_world->getPairCache()->setInternalGhostPairCallback(&keep(std::make_unique<btGhostPairCallback>()));
}

void WorldScene::prepareMeshes()
{
    const btCollisionObjectArray& objects = m_world->getCollisionObjectArray();
    for (int i = 0; i < objects.size(); ++i)
    {
        const btCollisionShape& shape = *objects[i]->getCollisionShape();
        if (shape.getShapeType() == TRIANGLE_MESH_SHAPE_PROXYTYPE)
            m_prepared.push_back(prepare(static_cast<const btBvhTriangleMeshShape&>(shape)));
    }
}

PhaseTimes WorldScene::step()
{
    const MarginScope margin(m_broadphase.margin);
    if (m_options.prepares && !m_hasStarted)
        prepareMeshes();
    m_hasStarted = true;
    direct();
    // Zero substeps: exactly one step, of length dt.
    return PhaseClock::measure(m_trace,
                               [this]
                               {
                                   change();
                                   m_world->stepSimulation(m_options.dt, 0);
                               });
}

int WorldScene::threads() const
{
    const bool isSerial = m_broadphase.cullet == nullptr && m_options.narrow != "dispatcher" &&
                          m_options.update == "bullet" && m_options.solver == "bullet" && !m_options.isMt;
    if (isSerial)
        return 1;
    return m_options.threads > 0 ? m_options.threads : static_cast<int>(std::thread::hardware_concurrency());
}

std::uint64_t WorldScene::pairCount() const
{
    return static_cast<std::uint64_t>(
        m_broadphase.broadphase->getOverlappingPairCache()->getNumOverlappingPairs());
}

std::uint64_t WorldScene::contactPairCount() const
{
    std::uint64_t count = 0;
    for (int i = 0; i < m_dispatcher->getNumManifolds(); ++i)
        count += m_dispatcher->getManifoldByIndexInternal(i)->getNumContacts() > 0 ? 1 : 0;
    return count;
}

void WorldScene::hashMore(std::uint64_t&) const {}

std::uint64_t WorldScene::stateHash() const
{
    std::uint64_t hash = 0xcbf29ce484222325ull;
    const btCollisionObjectArray& objects = m_world->getCollisionObjectArray();
    for (int i = 0; i < objects.size(); ++i)
    {
        const btTransform& transform = objects[i]->getWorldTransform();
        for (int row = 0; row < 3; ++row)
            hashScalars(hash, transform.getBasis()[row]);
        hashScalars(hash, transform.getOrigin());
    }
    hashMore(hash);
    return hash;
}

btScalar WorldScene::lowestHeight() const
{
    btScalar lowest = BT_LARGE_FLOAT;
    const btCollisionObjectArray& objects = m_world->getCollisionObjectArray();
    for (int i = 0; i < objects.size(); ++i)
    {
        if (!objects[i]->isStaticObject())
            lowest = std::min(lowest, objects[i]->getWorldTransform().getOrigin().y());
    }
    return lowest;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
