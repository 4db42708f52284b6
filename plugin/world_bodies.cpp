// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/world_bodies.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/plugin/step/awake_bodies.h"
#include "cullet/plugin/step/prefetch_step.h"
#include "cullet/plugin/step/split_impulse_row.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <new>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Bodies per task.
constexpr int kBodyGrain = 256;

/// Nanoseconds per body.
constexpr double kCostOfForce = 5, kCostOfThreshold = 5, kCostOfActivation = 10;
constexpr double kCostOfPrediction = 90, kCostOfIntegration = 120;

/// A body from its state to its forces, which follow the transforms.
void prefetchForces(const void* body)
{
    constexpr std::size_t kState = 2 * sizeof(btTransform) + 4 * sizeof(btVector3);
    prefetchBytes(body, kState, sizeof(btRigidBody) / 64 * 64 - 64);
}

void prefetchWhole(const void* body)
{
    prefetchBytes(body, 0, sizeof(btRigidBody) / 64 * 64);
}

/// @return whether a motion state was called
bool saveIfKinematic(btCollisionObject& object, btScalar timeStep)
{
    if (!object.isKinematicObject() || object.getActivationState() == ISLAND_SLEEPING)
        return false;
    btRigidBody* const body = btRigidBody::upcast(&object);
    if (body == nullptr)
        return false;
    const bool hasMotionState = body->getMotionState() != nullptr;
    body->saveKinematicState(timeStep);
    return hasMotionState;
}

/// Changes the state of a body whose deactivation time is up to date.
void updateState(btRigidBody& body)
{
    if (!body.wantsSleeping())
    {
        if (body.getActivationState() != DISABLE_DEACTIVATION)
            body.setActivationState(ACTIVE_TAG);
        return;
    }
    if (body.isStaticOrKinematicObject())
    {
        body.setActivationState(ISLAND_SLEEPING);
        return;
    }
    if (body.getActivationState() == ACTIVE_TAG)
        body.setActivationState(WANTS_DEACTIVATION);
    if (body.getActivationState() == ISLAND_SLEEPING)
    {
        body.setAngularVelocity(btVector3(0, 0, 0));
        body.setLinearVelocity(btVector3(0, 0, 0));
    }
}
}  // namespace

struct WorldBodies::Parts
{
    /// Calls body(index, body) for each body that has to be visited, in any order on any thread.
    ///
    /// @param cost nanoseconds of a body
    template <class Prefetch, class Body>
    void forEach(Bodies& bodies, double cost, const Prefetch& prefetch, const Body& body)
    {
        if (const Array<int>* const indices = awake.indices(bodies))
            forEachOf(
                bodies, static_cast<int>(indices->size()),
                [indices](int i) { return (*indices)[static_cast<std::size_t>(i)]; }, cost, prefetch, body);
        else
            forEachOf(
                bodies, bodies.size(), [](int i) { return i; }, cost, prefetch, body);
    }

    /// forEach() for those of some indices.
    template <class IndexOf, class Prefetch, class Body>
    void forEachOf(Bodies& bodies, int count, const IndexOf& indexOf, double cost, const Prefetch& prefetch,
                   const Body& body)
    {
        if (count == 0)
            return;
        btRigidBody** const first = &bodies[0];
        const auto runTask = [&](unsigned task)
        {
            constexpr int kAhead{kPrefetchDistance};
            const int begin = static_cast<int>(task) * kBodyGrain;
            const int end = std::min(count, begin + kBodyGrain);
            for (int i = begin; i < end; ++i)
            {
                if (i + kAhead < count)
                    prefetch(first[indexOf(i + kAhead)]);
                body(indexOf(i), *first[indexOf(i)]);
            }
        };
        runTasks(static_cast<unsigned>(count - 1) / kBodyGrain + 1, cost * double(count), runTask);
    }

    /// @param work nanoseconds of all tasks
    template <class Task>
    void runTasks(unsigned tasks, double work, const Task& task)
    {
        if (isReady())
        {
            workers->runRegion(work, [&] { workers->run(tasks, task); });
            return;
        }
        for (unsigned i = 0; i < tasks; ++i)
            task(i);
    }

    /// Whether loops can run on several threads: the first one allocates memory.
    bool isReady()
    {
        if (ready)
            return true;
        try
        {
            workers->runRegion([] {});
            ready = true;
        }
        catch (const std::bad_alloc&)
        {
            // Tried again in the next loop.
        }
        return ready;
    }

    bool hasThreshold(Bodies& bodies);

    std::unique_ptr<ParallelLoops> workers = std::make_unique<ParallelLoops>(0);
    bool ready = false;
    AwakeBodies awake;
    WorldBodiesStats stats;
};

WorldBodies::WorldBodies() : m(std::make_unique<Parts>()) {}

WorldBodies::~WorldBodies() = default;

void WorldBodies::setThreads(int threads)
{
    m->workers = std::make_unique<ParallelLoops>(threads);
    m->ready = false;
}

const WorldBodiesStats& WorldBodies::stats() const
{
    return m->stats;
}

void WorldBodies::listAwake(Bodies& bodies, btScalar timeStep)
{
    if (m->awake.areKnown())
        return;
    m->awake.forget();
    if (areFew(bodies))
        return;
    try
    {
        if (!m->awake.begin(bodies, timeStep))
            return;
        m->runTasks(static_cast<unsigned>(bodies.size() - 1) / AwakeBodies::kGrain + 1,
                    m->awake.costOfSearch(bodies.size()),
                    [&](unsigned task) { m->awake.examine(bodies, task); });
        m->awake.end(bodies);
    }
    catch (const std::bad_alloc&)
    {
        m->awake.forget();
    }
}

bool WorldBodies::sleepersStay() const
{
    return m->awake.sleepersStay();
}

void WorldBodies::forgetAwake()
{
    m->awake.forget();
}

void WorldBodies::suspendAwake()
{
    m->awake.suspend();
}

void WorldBodies::resumeAwake()
{
    m->awake.resume();
}

bool WorldBodies::haveNoMotionState(const Bodies& bodies) const
{
    const Array<int>* const indices = m->awake.indices(bodies);
    return indices != nullptr &&
           std::none_of(indices->begin(), indices->end(),
                        [&](int i)
                        { return bodies[i]->isActive() && bodies[i]->getMotionState() != nullptr; });
}

bool WorldBodies::saveKinematicState(btCollisionObjectArray& objects, btScalar timeStep,
                                     const Array<int>* restless)
{
    int first = 0;
    if (restless != nullptr)
    {
        for (const int i : *restless)
        {
            if (!saveIfKinematic(*objects[i], timeStep))
                continue;
            // The motion state may have changed any object, those at rest too.
            first = i + 1;
            break;
        }
        if (first == 0)
            return false;
    }
    bool hasCalled = first > 0;
    for (int i = first; i < objects.size(); ++i)
    {
        if (i + kPrefetchDistance < objects.size())
            prefetchState(objects[i + kPrefetchDistance]);
        hasCalled = saveIfKinematic(*objects[i], timeStep) || hasCalled;
    }
    return hasCalled;
}

bool WorldBodies::applyGravityToMany(Bodies& bodies)
{
    m->forEach(bodies, kCostOfForce, prefetchForces,
               [](int, btRigidBody& body)
               {
                   if (body.isActive())
                       body.applyGravity();
               });
    return true;
}

bool WorldBodies::clearForcesOfMany(Bodies& bodies)
{
    m->forEach(bodies, kCostOfForce, prefetchForces, [](int, btRigidBody& body) { body.clearForces(); });
    return true;
}

bool WorldBodies::predictMotionOfMany(Bodies& bodies, btScalar timeStep)
{
    BT_PROFILE("predictUnconstraintMotion");
    m->forEach(bodies, kCostOfPrediction, prefetchWhole,
               [this, timeStep](int index, btRigidBody& body)
               {
                   if (body.isStaticOrKinematicObject())
                       return;
                   body.applyDamping(timeStep);
                   body.predictIntegratedTransform(timeStep, body.getInterpolationWorldTransform());
                   m->awake.note(index, body);
               });
    return true;
}

/// Whether Bullet may sweep some body; sets the hit fractions of all of them. Bodies at rest have theirs, and are not swept.
bool WorldBodies::Parts::hasThreshold(Bodies& bodies)
{
    if (areFew(bodies))
    {
        bool hasOne = false;
        for (int i = 0; i < bodies.size(); ++i)
        {
            bodies[i]->setHitFraction(1);
            hasOne |= bodies[i]->getCcdSquareMotionThreshold() != btScalar(0);
        }
        return hasOne;
    }
    std::atomic<bool> hasAny{false};
    forEach(bodies, kCostOfThreshold, prefetchStateAndThreshold,
            [&hasAny](int, btRigidBody& body)
            {
                body.setHitFraction(1);
                if (body.getCcdSquareMotionThreshold() != btScalar(0))
                    hasAny.store(true, std::memory_order_relaxed);
            });
    return hasAny.load(std::memory_order_relaxed);
}

void WorldBodies::sweep(Bodies& bodies, const RangeFunction& sweep)
{
    m->stats = {};
    if (m->awake.indices(bodies) != nullptr)
        m->stats.restingBodies = m->awake.resting();
    const int count = m->hasThreshold(bodies) ? bodies.size() : 0;
    for (int i = 0; i < count; ++i)
    {
        if (bodies[i]->getCcdSquareMotionThreshold() == btScalar(0))
            continue;
        ++m->stats.sweptBodies;
        sweep(&bodies[i], 1);
    }
}

bool WorldBodies::integrateMany(Bodies& bodies, const RangeFunction& integrate)
{
    BT_PROFILE("integrateTransforms");
    if (m->hasThreshold(bodies))
    {
        integrate(&bodies[0], bodies.size());
        return true;
    }
    // Of other bodies Bullet's function sets the hit fraction only, which is set.
    const auto prefetch = [mostSleep = m->awake.mostSleep()](const void* body)
    {
        if (mostSleep)
            prefetchState(body);
        else
            prefetchWhole(body);
    };
    m->forEach(bodies, kCostOfIntegration, prefetch,
               [&](int, btRigidBody& body)
               {
                   btRigidBody* one = &body;
                   if (body.isActive() && !body.isStaticOrKinematicObject())
                       integrate(&one, 1);
               });
    const Array<int>* const awake = m->awake.indices(bodies);
    const std::uint64_t visited = awake != nullptr ? awake->size() : std::uint64_t(bodies.size());
    const bool isParallel = kCostOfIntegration * double(visited) >= 2 * ParallelLoops::workPerThread;
    m->stats.parallelBodies = isParallel && m->workers->threads() > 1 ? visited : 0;
    return true;
}

bool WorldBodies::updateActivationOfMany(Bodies& bodies, btScalar timeStep)
{
    if (splitImpulseRowOfBullet(false) == nullptr)
        return false;
    BT_PROFILE("updateActivationState");
    m->forEach(bodies, kCostOfActivation, prefetchForces,
               [timeStep](int, btRigidBody& body)
               {
                   body.updateDeactivation(timeStep);
                   updateState(body);
               });
    return true;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
