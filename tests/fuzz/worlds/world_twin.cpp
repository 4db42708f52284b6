// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/fuzz/worlds/world_twin.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/solver.h"
#include "cullet/plugin/world.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include <utility>

namespace cullet::test
{
namespace
{
constexpr int kCrowd = 2 * static_cast<int>(WorldBoxes::kGrain);

/// Bullet's pools of the usual size would take more time than an input.
btDefaultCollisionConstructionInfo smallPools()
{
    btDefaultCollisionConstructionInfo info;
    info.m_defaultMaxPersistentManifoldPoolSize = 64;
    info.m_defaultMaxCollisionAlgorithmPoolSize = 64;
    return info;
}

/// For all worlds of the program: those of one input have the same settings.
void shortenLoops(bool areShort)
{
    static const int few = WorldBodies::fewBodies;
    static const double work = ParallelLoops::workPerThread;
    WorldBodies::fewBodies = areShort ? 0 : few;
    ParallelLoops::workPerThread = areShort ? 1e-9 : work;
}
}  // namespace

WorldTwin::WorldTwin(TwinRecipe recipe, const WorldSettings& settings)
    : m_recipe(std::move(recipe)),
      m_settings(settings),
      m_configuration(std::make_unique<btDefaultCollisionConfiguration>(smallPools()))
{
    shortenLoops(m_settings.hasShortLoops);
    makeDispatcher();
    makeBroadphase();
    makeSolver();
    makeWorld();
    for (PairFilter& filter : m_filters)
        filter.onCall = [this] { callFilterAction(); };
}

WorldTwin::~WorldTwin()
{
    disarm();
    clear();
    for (auto& object : m_crowd)
        m_world->removeCollisionObject(object.get());
}

void WorldTwin::makeDispatcher()
{
    IsaGjkOptions isaGjk;
    // Worlds of boxes have the same bits with Bullet's dispatcher only with Bullet's own algorithm.
    const BoxPairs own =
        m_settings.family == ShapeFamily::Boxes ? BoxPairs::Bullet : BoxPairs::SeparatingAxes;
    isaGjk.boxPairs = m_settings.hasBoxBox ? BoxPairs::IsaGjk : own;
    if (m_recipe.narrow == NarrowPhase::Bullet || m_recipe.narrow == NarrowPhase::Registered)
    {
        m_dispatcher = std::make_unique<btCollisionDispatcher>(m_configuration.get());
        if (m_recipe.narrow == NarrowPhase::Registered)
            registerIsaGjk(*m_dispatcher, isaGjk);
        return;
    }
    DispatcherOptions options;
    options.threads = m_recipe.narrow == NarrowPhase::Dispatcher1 ? 1 : 2;
    options.isaGjk = isaGjk;
    m_dispatcher = std::make_unique<Dispatcher>(m_configuration.get(), options);
}

void WorldTwin::makeBroadphase()
{
    if (m_recipe.hasStockCache)
        m_stockCache = std::make_unique<btHashedOverlappingPairCache>();
    BroadphaseOptions options;
    options.margin = m_settings.margin;
    options.threads = m_recipe.threads;
    if (m_recipe.isDbvt)
    {
        m_broadphase = std::make_unique<btDbvtBroadphase>();
    }
    else
    {
        auto own = m_recipe.backend == nullptr ? std::make_unique<Broadphase>(m_stockCache.get(), options)
                                               : std::make_unique<Broadphase>(std::move(m_recipe.backend),
                                                                              m_stockCache.get(), options);
        m_own = own.get();
        m_broadphase = std::move(own);
    }
    if (m_settings.hasGhosts)
        m_broadphase->getOverlappingPairCache()->setInternalGhostPairCallback(&m_ghostPairs);
    if (!m_recipe.isWatched)
        return;
    using Promise = WatchedBroadphase::Promise;
    auto watched = std::make_unique<WatchedBroadphase>(std::move(m_broadphase),
                                                       m_recipe.isDbvt ? Promise::NoneMissed : Promise::Exact,
                                                       m_settings.margin, m_settings.hasGhosts);
    m_watched = watched.get();
    m_broadphase = std::move(watched);
}

void WorldTwin::makeSolver()
{
    if (m_settings.solver == SolverChoice::Bullet)
    {
        m_solver = std::make_unique<btSequentialImpulseConstraintSolver>();
        return;
    }
    SolverOptions options;
    options.model = m_settings.solver == SolverChoice::Own ? SolverModel::Bullet : SolverModel::Soft;
    options.threads = m_recipe.threads;
    m_solver = std::make_unique<Solver>(options);
}

void WorldTwin::makeWorld()
{
    if (m_recipe.hasParallelWorld)
    {
        auto world = std::make_unique<World<btDiscreteDynamicsWorld>>(m_dispatcher.get(), m_broadphase.get(),
                                                                      m_solver.get(), m_configuration.get());
        world->setUpdateThreads(m_recipe.threads);
        m_world = std::move(world);
    }
    else
    {
        m_world = std::make_unique<btDiscreteDynamicsWorld>(m_dispatcher.get(), m_broadphase.get(),
                                                            m_solver.get(), m_configuration.get());
    }
    m_world->setGravity(btVector3(0, -10, 0));
    m_world->getDispatchInfo().m_deterministicOverlappingPairs = m_settings.isOrdered;
    m_world->setWorldUserInfo(this);
}

void WorldTwin::changeBackend(std::unique_ptr<Backend> backend)
{
    if (m_own != nullptr)
        m_own->setBackend(std::move(backend));
}

btRigidBody* WorldTwin::body(std::size_t slot)
{
    return m_slots[slot].object == nullptr ? nullptr : btRigidBody::upcast(m_slots[slot].object.get());
}

std::size_t WorldTwin::freeSlot() const
{
    for (std::size_t slot = 0; slot < kSlots; ++slot)
        if (isFree(slot))
            return slot;
    return 0;
}

std::unique_ptr<btCollisionObject> WorldTwin::makeObject(const BodyRecipe& recipe, OwnedShape& shape) const
{
    using Kind = BodyRecipe::Kind;
    std::unique_ptr<btCollisionObject> object;
    if (recipe.kind == Kind::Ghost)
        object = std::make_unique<btGhostObject>();
    else if (recipe.kind == Kind::PairGhost)
        object = std::make_unique<btPairCachingGhostObject>();
    else if (recipe.kind == Kind::Plain)
        object = std::make_unique<btCollisionObject>();
    if (object != nullptr)
    {
        object->setCollisionShape(&shape.shape());
        object->setWorldTransform(recipe.pose);
        return object;
    }
    const btScalar mass = recipe.kind == Kind::Dynamic && !shape.isConcave() ? btScalar(1) : btScalar(0);
    btVector3 inertia(0, 0, 0);
    if (mass > 0)
        shape.shape().calculateLocalInertia(mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, &shape.shape(), inertia);
    info.m_startWorldTransform = recipe.pose;
    auto body = std::make_unique<btRigidBody>(info);
    if (recipe.kind == Kind::Kinematic)
        body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    else if (mass > 0)
        body->setLinearVelocity(recipe.velocity);
    if (m_settings.hasContinuous)
    {
        body->setCcdMotionThreshold(btScalar(0.05));
        body->setCcdSweptSphereRadius(btScalar(0.1));
    }
    return body;
}

void WorldTwin::addObject(btCollisionObject& object, int group, int mask)
{
    if (btRigidBody* body = btRigidBody::upcast(&object))
        m_world->addRigidBody(body, group, mask);
    else
        m_world->addCollisionObject(&object, group, mask);
}

void WorldTwin::removeObject(btCollisionObject& object)
{
    if (btRigidBody* body = btRigidBody::upcast(&object))
        m_world->removeRigidBody(body);
    else
        m_world->removeCollisionObject(&object);
}

void WorldTwin::create(std::size_t index, const BodyRecipe& recipe)
{
    Slot& slot = m_slots[index];
    if (slot.object != nullptr || slot.isBusy)
        return;
    auto shape = std::make_unique<OwnedShape>(recipe.shape);
    std::unique_ptr<btCollisionObject> object = makeObject(recipe, *shape);
    object->setUserIndex(static_cast<int>(index));
    slot.isBusy = true;
    try
    {
        addObject(*object, recipe.group, recipe.mask);
    }
    catch (const CallbackFailure&)
    {
        // Bullet has added the object without a proxy.
        removeObject(*object);
        slot.isBusy = false;
        throw;
    }
    slot.isBusy = false;
    slot.shape = std::move(shape);
    slot.object = std::move(object);
}

void WorldTwin::destroy(std::size_t index)
{
    Slot& slot = m_slots[index];
    if (slot.object == nullptr || slot.isBusy)
        return;
    for (std::size_t joint = 0; joint < kJoints; ++joint)
        if (m_joints[joint].joint != nullptr && (m_joints[joint].a == index || m_joints[joint].b == index))
            removeJoint(joint);
    removeObject(*slot.object);
    forget(slot);
}

void WorldTwin::forget(Slot& slot)
{
    slot.object.reset();
    slot.shape.reset();
}

void WorldTwin::clear()
{
    for (std::size_t slot = 0; slot < kSlots; ++slot)
        destroy(slot);
}

void WorldTwin::refresh(std::size_t index, int group, int mask)
{
    Slot& slot = m_slots[index];
    if (slot.object == nullptr || slot.isBusy)
        return;
    btBroadphaseProxy* proxy = slot.object->getBroadphaseHandle();
    proxy->m_collisionFilterGroup = group;
    proxy->m_collisionFilterMask = mask;
    slot.isBusy = true;
    try
    {
        m_world->refreshBroadphaseProxy(slot.object.get());
    }
    catch (const CallbackFailure&)
    {
        // Bullet has destroyed the old proxy and has no new one.
        slot.object->setBroadphaseHandle(nullptr);
        slot.isBusy = false;
        destroy(index);
        throw;
    }
    slot.isBusy = false;
}

void WorldTwin::swapShape(std::size_t index, const ShapeRecipe& recipe)
{
    Slot& slot = m_slots[index];
    if (slot.object == nullptr || slot.isBusy)
        return;
    auto shape = std::make_unique<OwnedShape>(recipe);
    // A mesh has no inertia.
    if (shape->isConcave() && !slot.object->isStaticOrKinematicObject())
        return;
    // Bullet's algorithms for other shapes know their classes.
    const bool areHulls = slot.shape->recipe().kind == ShapeKind::Hull && recipe.kind == ShapeKind::Hull &&
                          m_settings.family == ShapeFamily::All;
    if (!areHulls)
        m_world->getPairCache()->cleanProxyFromPairs(slot.object->getBroadphaseHandle(), m_dispatcher.get());
    slot.object->setCollisionShape(&shape->shape());
    slot.shape = std::move(shape);
}

void WorldTwin::addJoint(std::size_t index, int kind, std::size_t a, std::size_t b, bool disablesCollisions)
{
    btRigidBody *first = body(a), *second = body(b);
    if (m_joints[index].joint != nullptr || first == nullptr || second == nullptr || first == second)
        return;
    const btTransform here = btTransform::getIdentity();
    const btVector3 up(0, 1, 0), side(0, btScalar(0.5), 0);
    std::unique_ptr<btTypedConstraint> joint;
    if (kind == 0)
        joint = std::make_unique<btPoint2PointConstraint>(*first, *second, side, -side);
    else if (kind == 1)
        joint = std::make_unique<btHingeConstraint>(*first, *second, side, -side, up, up);
    else if (kind == 2)
        joint = std::make_unique<btSliderConstraint>(*first, *second, here, here, true);
    else
        joint = std::make_unique<btFixedConstraint>(*first, *second, here, here);
    m_world->addConstraint(joint.get(), disablesCollisions);
    m_joints[index] = {std::move(joint), a, b};
}

void WorldTwin::removeJoint(std::size_t index)
{
    if (m_joints[index].joint == nullptr)
        return;
    m_world->removeConstraint(m_joints[index].joint.get());
    m_joints[index].joint.reset();
}

void WorldTwin::addCrowd()
{
    m_crowdShape = std::make_unique<OwnedShape>(ShapeRecipe{ShapeKind::Sphere, 0, m_settings.family});
    for (int i = 0; i < kCrowd; ++i)
    {
        auto object = std::make_unique<btCollisionObject>();
        object->setCollisionShape(&m_crowdShape->shape());
        object->getWorldTransform().setIdentity();
        object->getWorldTransform().setOrigin(
            btVector3(btScalar(i % 23) / 2, btScalar(60 + i / 23), btScalar(i % 2)));
        object->setUserIndex(-1);
        m_world->addCollisionObject(object.get(), 64, 1);
        m_crowd.push_back(std::move(object));
    }
}

void WorldTwin::setFilter(int which)
{
    m_world->getPairCache()->setOverlapFilterCallback(which == 0 ? nullptr : &m_filters[which - 1]);
}

void WorldTwin::armFilter(int delay, std::function<void()> action)
{
    m_filterDelay = delay;
    m_filterAction = std::move(action);
}

void WorldTwin::callFilterAction()
{
    if (!m_filterAction || m_filterDelay-- > 0)
        return;
    const std::function<void()> action = std::exchange(m_filterAction, nullptr);
    action();
}

void WorldTwin::tick(btDynamicsWorld* world, btScalar /*time*/)
{
    auto* self = static_cast<WorldTwin*>(world->getWorldUserInfo());
    const std::function<void()> action = std::exchange(self->m_tickAction, nullptr);
    if (action)
        action();
}

void WorldTwin::armTick(bool isPreTick, std::function<void()> action)
{
    m_tickAction = std::move(action);
    m_world->setInternalTickCallback(nullptr, this, !isPreTick);
    m_world->setInternalTickCallback(&WorldTwin::tick, this, isPreTick);
}

void WorldTwin::disarm()
{
    m_filterAction = nullptr;
    m_tickAction = nullptr;
}
}  // namespace cullet::test
