// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/world_islands.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/core/function_address.h"
#include "cullet/plugin/solver.h"
#include "cullet/plugin/solver/solver_tasks.h"
#include "cullet/plugin/step/bullet_joints.h"
#include "cullet/plugin/step/island_groups.h"
#include "cullet/plugin/step/island_search.h"
#include "cullet/plugin/step/island_tasks.h"
#include "cullet/plugin/step/split_impulse_row.h"
#include "cullet/plugin/step/worker_solver.h"
#include "cullet/plugin/world_bodies.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <vector>

/// Bullet's own, which may be called on any thread; no header declares it.
void btEnterProfileZoneDefault(const char* name);

namespace cullet
{
inline namespace CULLET_PRECISION
{
struct WorldIslands::Parts
{
    bool solve(const Step& step);
    void reserve(const Step& step);
    SerialIslands reasonAgainst(const Step& step) const;
    bool skipSolver(const Step& step);
    void solveOneByOne(const Step& step);
    void collectGroups(const Step& step);
    double parallelWork() const;
    void solveOnThreads(const Step& step);
    void solveByOwn(SolverWithoutState& solver, const Step& step);
    void runTasks(const Step& step);
    void solveGroup(btConstraintSolver& solver, const Step& step, const IslandGroup& group);

    bool hasThreadSafeProfiler = false;
    bool areKept = false;  ///< the islands of this step are those of the last one, and all of them sleep
    std::unique_ptr<ParallelLoops> workers = std::make_unique<ParallelLoops>(0);
    std::vector<std::unique_ptr<WorkerSolver>> solvers;  ///< [thread]
    IslandSearch search;
    IslandGroups islands;
    std::vector<IslandGroup> groups;
    IslandTasks tasks;
    WorldIslandsStats stats;
};

namespace
{
bool hasForeignJoint(const WorldIslands::Joints& joints)
{
    for (int i = 0; i < joints.size(); ++i)
    {
        if (!isBulletJoint(*joints[i]))
            return true;
    }
    return false;
}

/// The solver, if it is one of cullet's that takes all groups of a step.
SolverWithoutState* ownSolver(btConstraintSolver& solver)
{
    // The comparison with one class spares the search for a base.
    if (isExactly<btSequentialImpulseConstraintSolver>(solver))
        return nullptr;
    auto* const own = dynamicCast<SolverWithoutState>(&solver);
    return own != nullptr && own->takesTasks() ? own : nullptr;
}

bool hasForeignRows(btConstraintSolver& solver, const btContactSolverInfo& info)
{
    return !WorkerSolver::hasBulletsRows(static_cast<btSequentialImpulseConstraintSolver&>(solver), info);
}

/// Whether not even all islands together are worth a second thread.
bool isLittleWork(const WorldIslands::Step& step)
{
    const auto bodies = static_cast<std::size_t>(step.manager.getUnionFind().getNumElements());
    const auto manifolds = static_cast<std::size_t>(step.world.getDispatcher()->getNumManifolds());
    return IslandTasks::workOf(bodies, manifolds, static_cast<std::size_t>(step.joints.size()),
                               step.info.m_numIterations) < 2 * ParallelLoops::workPerThread;
}

/// Whether Bullet's solver does nothing while all bodies sleep.
bool needsBodies(const WorldIslands::Step& step)
{
    // With them, Bullet's solver ends after the first iteration of nothing.
    const bool hasUsualEnd = step.info.m_numIterations > 0 && step.info.m_leastSquaresResidualThreshold >= 0;
    return step.joints.size() == 0 && hasUsualEnd && step.manager.getSplitIslands() &&
           isExactly<btSequentialImpulseConstraintSolver>(step.solver);
}

/// Whether Bullet would change neither a body nor a joint: the islands are as they are, and the solver has no rows.
bool isAtRest(const WorldIslands::Step& step)
{
    if (!needsBodies(step))
        return false;
    constexpr int kMobility = btCollisionObject::CF_STATIC_OBJECT | btCollisionObject::CF_KINEMATIC_OBJECT;
    const btCollisionObjectArray& objects = step.world.getCollisionObjectArray();
    for (int i = 0; i < objects.size(); ++i)
    {
        const btCollisionObject& object = *objects[i];
        const bool isStatic = (object.getCollisionFlags() & kMobility) == btCollisionObject::CF_STATIC_OBJECT;
        if (!isStatic && object.getActivationState() != ISLAND_SLEEPING)
            return false;
    }
    return true;
}

/// What a call of Bullet's solver without bodies leaves behind.
void countEmptyCall(btSequentialImpulseConstraintSolver& solver)
{
    btSolverAnalyticsData& counted = solver.m_analyticsData;
    ++counted.m_numSolverCalls;
    counted.m_numIterationsUsed = 1;
    counted.m_islandId = -2;
    counted.m_numBodies = counted.m_numContactManifolds = 0;
    counted.m_remainingLeastSquaresResidual = 0;
}

bool hasForeignRounding(const btContactSolverInfo& info)
{
    return info.m_splitImpulse && splitImpulseRowOfBullet((info.m_solverMode & SOLVER_SIMD) != 0) == nullptr;
}
}  // namespace

WorldIslands::WorldIslands() : m(std::make_unique<Parts>()) {}

WorldIslands::~WorldIslands() = default;

void WorldIslands::setThreads(int threads)
{
    m->workers = std::make_unique<ParallelLoops>(threads);
    m->solvers.clear();
}

void WorldIslands::setThreadSafeProfiler(bool isThreadSafe)
{
    m->hasThreadSafeProfiler = isThreadSafe;
}

const WorldIslandsStats& WorldIslands::stats() const
{
    return m->stats;
}

bool WorldIslands::find(btCollisionWorld& world, btSimulationIslandManager& manager,
                        const btAlignedObjectArray<btPersistentManifold*>& predictive, const Joints& joints,
                        const Array<int>* restless)
{
    m->areKept = false;
    if (areFew(world, joints))
        return false;
    try
    {
        m->search.reserve(restless != nullptr ? restless->size()
                                              : static_cast<std::size_t>(world.getNumCollisionObjects()));
    }
    catch (const std::bad_alloc&)
    {
        return false;
    }
    m->search.run({world, manager, predictive, joints, restless});
    return true;
}

bool WorldIslands::canKeep(const Step& step, const btAlignedObjectArray<btPersistentManifold*>& predictive)
{
    return needsBodies(step) && predictive.size() == 0 && isExactly<btSimulationIslandManager>(step.manager);
}

void WorldIslands::keep()
{
    BT_PROFILE("calculateSimulationIslands");
    m->areKept = true;
}

bool WorldIslands::solve(const Step& step)
{
    if (!m->areKept)
        return m->solve(step);
    m->areKept = false;
    m->stats = {};
    return m->skipSolver(step);
}

bool WorldIslands::Parts::solve(const Step& step)
{
    stats = {};
    if (areFew(step.world, step.joints) && isExactly<btSequentialImpulseConstraintSolver>(step.solver))
    {
        if (isAtRest(step))
            return skipSolver(step);
        stats.serial = SerialIslands::FewBodies;
        if (isLittleWork(step))
            return false;
    }
    stats.serial = reasonAgainst(step);
    if (stats.serial == SerialIslands::NotSplit)
        return false;
    try
    {
        reserve(step);
    }
    catch (const std::bad_alloc&)
    {
        stats.serial = SerialIslands::NoMemory;
        return false;
    }
    BT_PROFILE("solveConstraints");
    step.sortedJoints.resize(step.joints.size());
    for (int i = 0; i < step.joints.size(); ++i)
        step.sortedJoints[i] = step.joints[i];
    step.solver.prepareSolve(step.world.getNumCollisionObjects(),
                             step.world.getDispatcher()->getNumManifolds());
    islands.build(step.world, step.manager, step.sortedJoints, step.info.m_minimumSolverBatchSize);
    if (SolverWithoutState* const own = ownSolver(step.solver))
        solveByOwn(*own, step);
    else if (stats.serial == SerialIslands::No)
        solveOnThreads(step);
    else
        solveOneByOne(step);
    step.solver.allSolved(step.info, step.debugDrawer);
    return true;
}

bool WorldIslands::Parts::skipSolver(const Step& step)
{
    BT_PROFILE("solveConstraints");
    stats.serial = SerialIslands::AtRest;
    step.sortedJoints.resizeNoInitialize(0);
    countEmptyCall(static_cast<btSequentialImpulseConstraintSolver&>(step.solver));
    return true;
}

/// Allocates all that the step needs. Throws std::bad_alloc.
void WorldIslands::Parts::reserve(const Step& step)
{
    islands.reserve(step.world, step.manager, static_cast<std::size_t>(step.joints.size()));
    if (stats.serial != SerialIslands::No && stats.serial != SerialIslands::OwnSolver)
        return;
    const auto mostGroups = static_cast<std::size_t>(step.manager.getUnionFind().getNumElements()) + 1;
    groups.clear();
    groups.reserve(mostGroups);
    tasks.reserve(mostGroups, islands.mostSharedThings());
    if (stats.serial == SerialIslands::OwnSolver)
        return;
    if (solvers.size() == workers->threads())
        return;
    // Its first region allocates too.
    workers->runRegion([] {});
    while (solvers.size() < workers->threads())
        solvers.push_back(std::make_unique<WorkerSolver>());
}

SerialIslands WorldIslands::Parts::reasonAgainst(const Step& step) const
{
    if (!step.manager.getSplitIslands())
        return SerialIslands::NotSplit;
    if (ownSolver(step.solver) != nullptr)
        return SerialIslands::OwnSolver;
    if (workers->threads() == 1)
        return SerialIslands::FewThreads;
    if (!isExactly<btSequentialImpulseConstraintSolver>(step.solver))
        return SerialIslands::ForeignSolver;
    if ((step.info.m_solverMode & SOLVER_RANDMIZE_ORDER) != 0)
        return SerialIslands::RandomOrder;
    if (hasForeignRows(step.solver, step.info))
        return SerialIslands::ForeignRows;
    if (hasForeignRounding(step.info))
        return SerialIslands::ForeignRounding;
    if (!hasThreadSafeProfiler &&
        btGetCurrentEnterProfileZoneFunc() != addressInLibrary(btEnterProfileZoneDefault))
        return SerialIslands::Profiler;
    if (hasForeignJoint(step.joints))
        return SerialIslands::ForeignJoint;
    return isLittleWork(step) ? SerialIslands::LittleWork : SerialIslands::No;
}

/// Finds and solves one group after the other, since code of the application may run in between.
void WorldIslands::Parts::solveOneByOne(const Step& step)
{
    BT_PROFILE("processIslands");
    for (IslandGroup group; islands.next(group); ++stats.groups)
        solveGroup(step.solver, step, group);
}

void WorldIslands::Parts::solveGroup(btConstraintSolver& solver, const Step& step, const IslandGroup& group)
{
    solver.solveGroup(islands.bodies(group), group.bodies.size(), islands.manifolds(group),
                      group.manifolds.size(), islands.joints(group), group.joints.size(), step.info,
                      step.debugDrawer, step.world.getDispatcher());
}

/// Finds all groups, and divides them into tasks.
void WorldIslands::Parts::collectGroups(const Step& step)
{
    for (IslandGroup group; islands.next(group);)
        groups.push_back(group);
    stats.groups = static_cast<std::uint32_t>(groups.size());
    tasks.build(islands, groups, step.info.m_numIterations);
    stats.sharingGroups = tasks.sharingGroups();
}

void WorldIslands::Parts::solveOnThreads(const Step& step)
{
    BT_PROFILE("processIslands");
    collectGroups(step);
    if (parallelWork() < 2 * ParallelLoops::workPerThread)
    {
        stats.serial = SerialIslands::LittleWork;
        for (const IslandGroup& group : groups)
            solveGroup(step.solver, step, group);
        return;
    }
    stats.tasks = tasks.tasks();
    try
    {
        runTasks(step);
    }
    catch (...)
    {
        // Their pools hold the rows of groups that were not finished.
        solvers.clear();
        throw;
    }
}

/// Gives all groups to a solver that divides them among threads of its own.
void WorldIslands::Parts::solveByOwn(SolverWithoutState& solver, const Step& step)
{
    BT_PROFILE("processIslands");
    collectGroups(step);
    stats.tasks = tasks.tasks();
    solver.solveTasks({islands, groups, tasks, step.info, step.debugDrawer, step.world.getDispatcher()});
}

/// The work for which threads pay: no more of them than make the longest task the last one.
double WorldIslands::Parts::parallelWork() const
{
    const double beside = tasks.work() - tasks.longestWork();
    const double mostThreads = std::ceil(tasks.work() / std::max(tasks.longestWork(), 1.0));
    return std::min({tasks.work(), 2 * beside, mostThreads * ParallelLoops::workPerThread});
}

void WorldIslands::Parts::runTasks(const Step& step)
{
    auto& solver = static_cast<btSequentialImpulseConstraintSolver&>(step.solver);
    for (const auto& worker : solvers)
        worker->forgetGroups();
    const auto runTask = [&](unsigned task, unsigned thread)
    {
        WorkerSolver& worker = *solvers[thread];
        tasks.forEachGroup(task,
                           [&](std::uint32_t group)
                           {
                               solveGroup(worker, step, groups[group]);
                               worker.noteGroup(group);
                           });
    };
    workers->runRegion(parallelWork(), [&] { workers->run(tasks.tasks(), runTask); });
    WorkerSolver::report(solvers, solver);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
