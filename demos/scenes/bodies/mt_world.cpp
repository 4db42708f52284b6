// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/bodies/mt_world.h"

#include "cullet/demos/program/exit_code.h"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcherMt.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolverMt.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorldMt.h>
#include <LinearMath/btThreads.h>

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Null without BT_THREADSAFE. Never destroyed: worlds may live as long as the process.
btITaskScheduler* scheduler()
{
    static btITaskScheduler* const made = btCreateDefaultTaskScheduler();
    return made;
}

/// Must precede what Bullet sizes by the number of threads.
void useThreads(int threads)
{
    if (scheduler() == nullptr)
        throw ProgramError(kExitUnavailable,
                           "Bullet's multithreaded world: this program's Bullet library was built "
                           "without BT_THREADSAFE; configure with "
                           "-DCULLET_THREADSAFE_BULLET=PREFIX of one that was built with it");
    if (btGetTaskScheduler() != scheduler())
        btSetTaskScheduler(scheduler());
    const int most = scheduler()->getMaxNumThreads();
    scheduler()->setNumThreads(threads == 0 ? most : std::min(threads, most));
}

class MtWorld : public btDiscreteDynamicsWorldMt
{
public:
    MtWorld(btDispatcher& dispatcher, btBroadphaseInterface& broadphase, btConstraintSolver& pool,
            btCollisionConfiguration& configuration, int threads)
        : btDiscreteDynamicsWorldMt(&dispatcher, &broadphase, static_cast<btConstraintSolverPoolMt*>(&pool),
                                    &m_largeIslands, &configuration),
          m_threads(threads)
    {
    }

    int stepSimulation(btScalar timeStep, int maxSubSteps, btScalar fixedTimeStep) override
    {
        useThreads(m_threads);
        return btDiscreteDynamicsWorldMt::stepSimulation(timeStep, maxSubSteps, fixedTimeStep);
    }

private:
    btSequentialImpulseConstraintSolverMt m_largeIslands;
    int m_threads;
};

std::unique_ptr<btDefaultCollisionConfiguration> makeConfiguration()
{
    // As Bullet's examples: threads that find a pool empty wait for the memory allocator.
    btDefaultCollisionConstructionInfo info;
    info.m_defaultMaxPersistentManifoldPoolSize = 80000;
    info.m_defaultMaxCollisionAlgorithmPoolSize = 80000;
    return std::make_unique<btDefaultCollisionConfiguration>(info);
}
}  // namespace

bool isBulletThreadSafe()
{
    return scheduler() != nullptr;
}

std::unique_ptr<btCollisionDispatcher> makeMtDispatcher(btCollisionConfiguration& configuration, int threads)
{
    useThreads(threads);
    return std::make_unique<btCollisionDispatcherMt>(&configuration);
}

const WorldKind& mtWorld()
{
    static const WorldKind kind = {
        makeConfiguration,
        []() -> std::unique_ptr<btConstraintSolver>
        { return std::make_unique<btConstraintSolverPoolMt>(static_cast<int>(BT_MAX_THREAD_COUNT)); },
        nullptr,
        [](btDispatcher& dispatcher, btBroadphaseInterface& broadphase, btConstraintSolver& pool,
           btCollisionConfiguration& configuration, int threads) -> std::unique_ptr<btDiscreteDynamicsWorld>
        { return std::make_unique<MtWorld>(dispatcher, broadphase, pool, configuration, threads); }};
    return kind;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
