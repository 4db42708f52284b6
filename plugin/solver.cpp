// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/broad/log.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/solver/group_solver.h"
#include "cullet/plugin/solver/soft_settings.h"
#include "cullet/plugin/solver/solver_tasks.h"
#include "cullet/plugin/step/bullet_joints.h"
#include "cullet/plugin/step/worker_solver.h"

#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>
#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <new>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// A task of at least this share of a thread's work is solved by all threads together.
constexpr double kWideShare = 0.5;
/// Nanoseconds for which that pays.
constexpr double kWideWork = 1e6;

SolverOptions inRange(SolverOptions options)
{
    const SolverOptions standard;
    const auto orStandard = [](btScalar& value, btScalar instead)
    {
        if (!(std::isfinite(value) && value > 0))
            value = instead;
    };
    options.threads = std::max(options.threads, 0);
    options.substeps = std::clamp(options.substeps, 1, 64);
    orStandard(options.contactFrequency, standard.contactFrequency);
    orStandard(options.contactDamping, standard.contactDamping);
    orStandard(options.pushSpeed, standard.pushSpeed);
    return options;
}

/// Bullet solves a cone-twist joint of that kind by a function that it calls in each iteration.
bool solvesItself(btTypedConstraint& joint)
{
    if (joint.getConstraintType() != CONETWIST_CONSTRAINT_TYPE || !joint.isEnabled())
        return false;
    btTypedConstraint::btConstraintInfo1 rows;
    joint.getInfo1(&rows);
    return rows.m_numConstraintRows == 0;
}

bool hasForeignJoint(const SolverGroup& group)
{
    return std::any_of(group.joints, group.joints + group.jointCount,
                       [](btTypedConstraint* joint)
                       { return !isBulletJoint(*joint) || solvesItself(*joint); });
}

SolverGroup groupOf(const SolverTasks& what, std::uint32_t number)
{
    const IslandGroup& group = what.groups[number];
    return {what.islands.bodies(group), group.bodies.size(),        what.islands.manifolds(group),
            group.manifolds.size(),     what.islands.joints(group), group.joints.size()};
}

/// An estimate: one thread finds the colours, and threads wait for each other at the end of each colour, of which an iteration
/// has two times ten.
constexpr double kSharedPart = 0.5;

/// Nanoseconds that one thread needs for the part of a group that others can take over.
double workOf(const SolverGroup& group, const btContactSolverInfo& info)
{
    const double iterations = info.m_numIterations;
    const double work = 80.0 * group.bodyCount + (250.0 + 65.0 * iterations) * group.manifoldCount +
                        (1000.0 + 60.0 * iterations) * group.jointCount;
    return work * kSharedPart;
}

const char* warningOf(SolverRefusal refusal)
{
    return refusal == SolverRefusal::RandomOrder
               ? "Solver: SOLVER_RANDMIZE_ORDER is left to Bullet's solver, on one thread"
               : "Solver: row functions of the application are left to Bullet's solver, on one thread";
}
}  // namespace

struct SolverWithoutState::Parts
{
    Parts(btSequentialImpulseConstraintSolver& solver, const SolverOptions& with)
        : owner(solver), options(inRange(with)), loops(options.threads)
    {
    }

    SolverRefusal refusalOfStep(const btContactSolverInfo& info);
    void warnOfSettings(const btContactSolverInfo& info);
    void solve(const SolverGroup& group, const btContactSolverInfo& info, btIDebugDraw* debugDrawer,
               btDispatcher* dispatcher);
    void solveOwn(const SolverGroup& group, const btContactSolverInfo& info, btIDebugDraw* debugDrawer,
                  btDispatcher* dispatcher);
    void finish(const GroupReport& report, const SolverGroup& group, const btContactSolverInfo& info,
                btIDebugDraw* debugDrawer, btDispatcher* dispatcher);
    void solveByBullet(SolverRefusal refusal, const SolverGroup& group, const btContactSolverInfo& info,
                       btIDebugDraw* debugDrawer, btDispatcher* dispatcher);
    GroupReport solveWith(GroupSolver& solver, const SolverGroup& group, const btContactSolverInfo& info,
                          ParallelLoops& with);
    bool haveSolvers(std::size_t count);
    bool reserveShared(const SolverTasks& what);
    void note(const GroupReport& report, const SolverGroup& group);
    bool isAlone(const SolverTasks& what, unsigned task);
    void solve(const SolverTasks& what, std::uint32_t group);
    void solveShared(const SolverTasks& what);
    void runShared(const SolverTasks& what);

    btSequentialImpulseConstraintSolver& owner;
    SolverOptions options;
    ParallelLoops loops;
    std::vector<std::unique_ptr<GroupSolver>> solvers;  ///< [thread]
    std::vector<unsigned> sharedTasks;
    std::vector<GroupReport> reports;  ///< [group] of shared tasks
    IslandSelection ownIslands;        ///< of a group with foreign joints
    SolverStats stats;
    bool hasThreads = false, hasWarnedOfRefusal = false, hasWarnedOfSettings = false;
};

Solver::Solver(const SolverOptions& options) : m(makeParts(*this, options)) {}

Solver::~Solver() = default;

bool Solver::takesTasks() const
{
    return isExactly<Solver>(*this);
}

Solver::Parts& Solver::parts() const
{
    return *m;
}

std::shared_ptr<SolverWithoutState::Parts> SolverWithoutState::makeParts(
    btSequentialImpulseConstraintSolver& solver, const SolverOptions& options)
{
    return std::make_shared<Parts>(solver, options);
}

const SolverOptions& SolverWithoutState::options() const
{
    return parts().options;
}

const SolverStats& SolverWithoutState::stats() const
{
    return parts().stats;
}

const SolverStats& SolverWithoutState::statsOf(const Parts& parts)
{
    return parts.stats;
}

btScalar SolverWithoutState::solveGroup(btCollisionObject** bodies, int bodyCount,
                                        btPersistentManifold** manifolds, int manifoldCount,
                                        btTypedConstraint** joints, int jointCount,
                                        const btContactSolverInfo& info, btIDebugDraw* debugDrawer,
                                        btDispatcher* dispatcher)
{
    BT_PROFILE("solveGroup");
    Parts& own = parts();
    own.stats = {};
    own.warnOfSettings(info);
    own.solve({bodies, bodyCount, manifolds, manifoldCount, joints, jointCount}, info, debugDrawer,
              dispatcher);
    return 0;
}

void SolverWithoutState::Parts::solve(const SolverGroup& group, const btContactSolverInfo& info,
                                      btIDebugDraw* debugDrawer, btDispatcher* dispatcher)
{
    const SolverRefusal ofStep = refusalOfStep(info);
    if (ofStep != SolverRefusal::No)
        return solveByBullet(ofStep, group, info, debugDrawer, dispatcher);
    if (!hasForeignJoint(group))
        return solveOwn(group, info, debugDrawer, dispatcher);
    SolverGroup others;
    try
    {
        others = ownIslands.select(group, [](const SolverGroup& island) { return !hasForeignJoint(island); });
    }
    catch (const std::bad_alloc&)
    {
        return solveByBullet(SolverRefusal::NoMemory, group, info, debugDrawer, dispatcher);
    }
    GroupIslands islands(group);
    for (SolverGroup island; islands.next(island);)
    {
        if (hasForeignJoint(island))
            solveByBullet(SolverRefusal::ForeignJoint, island, info, debugDrawer, dispatcher);
    }
    if (others.bodyCount > 0)
        solveOwn(others, info, debugDrawer, dispatcher);
}

/// Solves a group without foreign joints.
void SolverWithoutState::Parts::solveOwn(const SolverGroup& group, const btContactSolverInfo& info,
                                         btIDebugDraw* debugDrawer, btDispatcher* dispatcher)
{
    if (!haveSolvers(1))
        return solveByBullet(SolverRefusal::NoMemory, group, info, debugDrawer, dispatcher);
    finish(solveWith(*solvers[0], group, info, loops), group, info, debugDrawer, dispatcher);
}

/// Counts a group, or lets Bullet's solver solve what is left of it.
void SolverWithoutState::Parts::finish(const GroupReport& report, const SolverGroup& group,
                                       const btContactSolverInfo& info, btIDebugDraw* debugDrawer,
                                       btDispatcher* dispatcher)
{
    using Outcome = GroupReport::Outcome;
    if (report.outcome == Outcome::NoMemory)
        solveByBullet(SolverRefusal::NoMemory, group, info, debugDrawer, dispatcher);
    if (report.outcome == Outcome::Solved || report.outcome == Outcome::NoMemoryForRest)
        note(report, group);
    if (report.outcome != Outcome::NoMemoryForRest)
        return;
    GroupIslands islands(group);
    for (SolverGroup island; islands.next(island);)
    {
        if (hasOwnSoftness(island))
            solveByBullet(SolverRefusal::NoMemory, island, info, debugDrawer, dispatcher);
    }
}

/// Makes the solvers, and registers with the threads: nothing of that may fail when a group is half solved.
///
/// @return false without memory for it
bool SolverWithoutState::Parts::haveSolvers(std::size_t count)
{
    try
    {
        if (!hasThreads)
            loops.runRegion([] {});
        hasThreads = true;
        while (solvers.size() < count)
            solvers.push_back(std::make_unique<GroupSolver>());
        return true;
    }
    catch (const std::bad_alloc&)
    {
        return false;
    }
}

/// Makes room for what solveShared() writes.
///
/// @return false without memory for it
bool SolverWithoutState::Parts::reserveShared(const SolverTasks& what)
{
    try
    {
        sharedTasks.reserve(what.tasks.tasks());
        reports.assign(what.groups.size(), {});
    }
    catch (const std::bad_alloc&)
    {
        return false;
    }
    return haveSolvers(loops.threads());
}

SolverRefusal SolverWithoutState::Parts::refusalOfStep(const btContactSolverInfo& info)
{
    if ((info.m_solverMode & SOLVER_RANDMIZE_ORDER) != 0)
        return SolverRefusal::RandomOrder;
    return WorkerSolver::hasBulletsRows(owner, info) ? SolverRefusal::No : SolverRefusal::ForeignRows;
}

void SolverWithoutState::Parts::warnOfSettings(const btContactSolverInfo& info)
{
    if (options.model != SolverModel::Soft || hasWarnedOfSettings)
        return;
    const SoftSettings settings(info);
    if (settings.names()[0] == '\0')
        return;
    hasWarnedOfSettings = true;
    char text[320];
    std::snprintf(text, sizeof(text), "Solver: SolverModel::Soft has no use for %s", settings.names());
    log(LogLevel::Warning, text);
}

void SolverWithoutState::Parts::solveByBullet(SolverRefusal refusal, const SolverGroup& group,
                                              const btContactSolverInfo& info, btIDebugDraw* debugDrawer,
                                              btDispatcher* dispatcher)
{
    const bool isSetting = refusal == SolverRefusal::RandomOrder || refusal == SolverRefusal::ForeignRows;
    if (isSetting && !hasWarnedOfRefusal)
        log(LogLevel::Warning, warningOf(refusal));
    hasWarnedOfRefusal = hasWarnedOfRefusal || isSetting;
    ++stats.groups;
    ++stats.refusedGroups;
    stats.refusal = refusal;
    owner.btSequentialImpulseConstraintSolver::solveGroup(group.bodies, group.bodyCount, group.manifolds,
                                                          group.manifoldCount, group.joints, group.jointCount,
                                                          info, debugDrawer, dispatcher);
}

GroupReport SolverWithoutState::Parts::solveWith(GroupSolver& solver, const SolverGroup& group,
                                                 const btContactSolverInfo& info, ParallelLoops& with)
{
    GroupReport report;
    with.runRegion(workOf(group, info), [&] { report = solver.solve(group, info, options, with); });
    return report;
}

/// Counts a group, and says of it what Bullet's solver would say.
void SolverWithoutState::Parts::note(const GroupReport& report, const SolverGroup& group)
{
    ++stats.groups;
    stats.contacts += report.contacts;
    stats.joints += report.joints;
    stats.serialConstraints += report.serialConstraints;
    btSolverAnalyticsData& data = owner.m_analyticsData;
    ++data.m_numSolverCalls;
    data.m_numIterationsUsed = report.iterations;
    data.m_islandId = group.bodyCount > 0 ? 0 : -2;
    data.m_numBodies = group.bodyCount;
    data.m_numContactManifolds = group.manifoldCount;
    data.m_remainingLeastSquaresResidual = double(report.residual);
}

/// Whether all threads solve the groups of a task together, or Bullet's solver some.
bool SolverWithoutState::Parts::isAlone(const SolverTasks& what, unsigned task)
{
    if (what.tasks.taskWork(task) > std::max(kWideWork, kWideShare * what.tasks.work() / loops.threads()))
        return true;
    bool isForeignTask = false;
    what.tasks.forEachGroup(task, [&](std::uint32_t group)
                            { isForeignTask = isForeignTask || hasForeignJoint(groupOf(what, group)); });
    return isForeignTask;
}

void SolverWithoutState::solveTasks(const SolverTasks& what)
{
    Parts& own = parts();
    own.stats = {};
    own.warnOfSettings(what.info);
    std::vector<unsigned>& shared = own.sharedTasks;
    shared.clear();
    own.reports.clear();
    const bool isInTurn = own.refusalOfStep(what.info) != SolverRefusal::No || own.loops.threads() == 1 ||
                          !own.reserveShared(what);
    for (unsigned task = 0; task < what.tasks.tasks(); ++task)
    {
        if (isInTurn || own.isAlone(what, task))
            what.tasks.forEachGroup(task, [&](std::uint32_t group) { own.solve(what, group); });
        else
            shared.push_back(task);
    }
    if (!shared.empty())
        own.solveShared(what);
}

void SolverWithoutState::Parts::solve(const SolverTasks& what, std::uint32_t group)
{
    solve(groupOf(what, group), what.info, what.debugDrawer, what.dispatcher);
}

/// Solves the groups of small tasks, each on one thread.
void SolverWithoutState::Parts::solveShared(const SolverTasks& what)
{
    runShared(what);
    for (std::uint32_t number = 0; number < reports.size(); ++number)
        finish(reports[number], groupOf(what, number), what.info, what.debugDrawer, what.dispatcher);
}

void SolverWithoutState::Parts::runShared(const SolverTasks& what)
{
    double work = 0;
    for (const unsigned task : sharedTasks)
        work += what.tasks.taskWork(task);
    const auto solveTask = [&](unsigned index, unsigned thread)
    {
        ParallelLoops onOneThread(1);
        const auto solveOne = [&](std::uint32_t group)
        { reports[group] = solveWith(*solvers[thread], groupOf(what, group), what.info, onOneThread); };
        what.tasks.forEachGroup(sharedTasks[index], solveOne);
    };
    loops.runRegion(work, [&] { loops.run(static_cast<unsigned>(sharedTasks.size()), solveTask); });
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
