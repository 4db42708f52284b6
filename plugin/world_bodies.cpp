// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/world_bodies.h"

#include "cullet/base/threads/parallel_loops.h"
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
    /// Calls body(body) for each body, in any order on any thread.
    ///
    /// @param cost nanoseconds of a body
    template <class Prefetch, class Body>
    void forEach(Bodies& bodies, double cost, const Prefetch& prefetch, const Body& body)
    {
        const int count = bodies.size();
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
                    prefetch(first[i + kAhead]);
                body(first[i]);
            }
        };
        const unsigned tasks = static_cast<unsigned>(count - 1) / kBodyGrain + 1;
        if (isReady())
        {
            workers->runRegion(cost * double(count), [&] { workers->run(tasks, runTask); });
            return;
        }
        for (unsigned task = 0; task < tasks; ++task)
            runTask(task);
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
               [](btRigidBody* body)
               {
                   if (body->isActive())
                       body->applyGravity();
               });
    return true;
}

bool WorldBodies::clearForcesOfMany(Bodies& bodies)
{
    m->forEach(bodies, kCostOfForce, prefetchForces, [](btRigidBody* body) { body->clearForces(); });
    return true;
}

bool WorldBodies::predictMotionOfMany(Bodies& bodies, btScalar timeStep)
{
    BT_PROFILE("predictUnconstraintMotion");
    m->forEach(bodies, kCostOfPrediction, prefetchWhole,
               [timeStep](btRigidBody* body)
               {
                   if (body->isStaticOrKinematicObject())
                       return;
                   body->applyDamping(timeStep);
                   body->predictIntegratedTransform(timeStep, body->getInterpolationWorldTransform());
               });
    return true;
}

/// Whether Bullet may sweep some body; sets the hit fractions of all of them.
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
            [&hasAny](btRigidBody* body)
            {
                body->setHitFraction(1);
                if (body->getCcdSquareMotionThreshold() != btScalar(0))
                    hasAny.store(true, std::memory_order_relaxed);
            });
    return hasAny.load(std::memory_order_relaxed);
}

void WorldBodies::sweep(Bodies& bodies, const RangeFunction& sweep)
{
    m->stats = {};
    if (!m->hasThreshold(bodies))
        return;
    for (int i = 0; i < bodies.size(); ++i)
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
    m->forEach(bodies, kCostOfIntegration, prefetchWhole, [&](btRigidBody* body) { integrate(&body, 1); });
    const bool isParallel = kCostOfIntegration * bodies.size() >= 2 * ParallelLoops::workPerThread;
    m->stats.parallelBodies = isParallel && m->workers->threads() > 1 ? std::uint64_t(bodies.size()) : 0;
    return true;
}

bool WorldBodies::updateActivationOfMany(Bodies& bodies, btScalar timeStep)
{
    if (splitImpulseRowOfBullet(false) == nullptr)
        return false;
    BT_PROFILE("updateActivationState");
    m->forEach(bodies, kCostOfActivation, prefetchForces,
               [timeStep](btRigidBody* body)
               {
                   if (body == nullptr)
                       return;
                   body->updateDeactivation(timeStep);
                   updateState(*body);
               });
    return true;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
