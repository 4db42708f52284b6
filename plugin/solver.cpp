// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/broad/log.h"
#include "cullet/plugin/solver/group_solver.h"
#include "cullet/plugin/solver/solver_tasks.h"
#include "cullet/plugin/step/bullet_joints.h"
#include "cullet/plugin/step/worker_solver.h"

#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>
#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <cmath>
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

bool isForeign(btTypedConstraint& joint)
{
    return !isBulletJoint(joint) || solvesItself(joint);
}

SolverGroup groupOf(const SolverTasks& what, std::uint32_t number)
{
    const IslandGroup& group = what.groups[number];
    return {what.islands.bodies(group), group.bodies.size(),        what.islands.manifolds(group),
            group.manifolds.size(),     what.islands.joints(group), group.joints.size()};
}

/// Nanoseconds that one thread needs for a group.
double workOf(const SolverGroup& group, const btContactSolverInfo& info)
{
    const double iterations = info.m_numIterations;
    return 80.0 * group.bodyCount + (250.0 + 65.0 * iterations) * group.manifoldCount +
           (1000.0 + 60.0 * iterations) * group.jointCount;
}

const char* warningOf(SolverRefusal refusal)
{
    return refusal == SolverRefusal::RandomOrder
               ? "Solver: SOLVER_RANDMIZE_ORDER is left to Bullet's solver, on one thread"
               : "Solver: row functions of the application are left to Bullet's solver, on one thread";
}
}  // namespace

struct Solver::Parts
{
    explicit Parts(Solver& solver, const SolverOptions& with)
        : owner(solver), options(inRange(with)), loops(options.threads)
    {
    }

    SolverRefusal refusalOf(const SolverGroup& group, const btContactSolverInfo& info);
    SolverRefusal refusalOfStep(const btContactSolverInfo& info);
    void solve(const SolverGroup& group, const btContactSolverInfo& info, btIDebugDraw* debugDrawer,
               btDispatcher* dispatcher);
    void solveByBullet(SolverRefusal refusal, const SolverGroup& group, const btContactSolverInfo& info,
                       btIDebugDraw* debugDrawer, btDispatcher* dispatcher);
    bool tryToSolve(GroupSolver& solver, const SolverGroup& group, const btContactSolverInfo& info,
                    ParallelLoops& with);
    static void count(const GroupSolver& solver, SolverStats& into);
    bool isAlone(const SolverTasks& what, unsigned task);
    void solve(const SolverTasks& what, std::uint32_t group);
    void solveShared(const SolverTasks& what);

    Solver& owner;
    SolverOptions options;
    ParallelLoops loops;
    std::vector<std::unique_ptr<GroupSolver>> solvers;  ///< [thread]
    std::vector<unsigned> sharedTasks;
    std::vector<std::uint8_t> failed;  ///< [group]
    std::vector<SolverStats> counts;   ///< [thread]
    SolverStats stats;
    bool hasWarned = false;
};

Solver::Solver(const SolverOptions& options) : m(std::make_unique<Parts>(*this, options)) {}

Solver::~Solver() = default;

const SolverOptions& Solver::options() const
{
    return m->options;
}

const SolverStats& Solver::stats() const
{
    return m->stats;
}

btScalar Solver::solveGroup(btCollisionObject** bodies, int bodyCount, btPersistentManifold** manifolds,
                            int manifoldCount, btTypedConstraint** joints, int jointCount,
                            const btContactSolverInfo& info, btIDebugDraw* debugDrawer,
                            btDispatcher* dispatcher)
{
    BT_PROFILE("solveGroup");
    m->stats = {};
    m->solve({bodies, bodyCount, manifolds, manifoldCount, joints, jointCount}, info, debugDrawer,
             dispatcher);
    return 0;
}

void Solver::Parts::solve(const SolverGroup& group, const btContactSolverInfo& info,
                          btIDebugDraw* debugDrawer, btDispatcher* dispatcher)
{
    if (solvers.empty())
        solvers.push_back(std::make_unique<GroupSolver>());
    SolverRefusal refusal = refusalOf(group, info);
    if (refusal == SolverRefusal::No && !tryToSolve(*solvers[0], group, info, loops))
        refusal = SolverRefusal::NoMemory;
    if (refusal != SolverRefusal::No)
        return solveByBullet(refusal, group, info, debugDrawer, dispatcher);
    count(*solvers[0], stats);
}

SolverRefusal Solver::Parts::refusalOf(const SolverGroup& group, const btContactSolverInfo& info)
{
    const SolverRefusal ofStep = refusalOfStep(info);
    if (ofStep != SolverRefusal::No)
        return ofStep;
    const bool isOwn = std::none_of(group.joints, group.joints + group.jointCount,
                                    [](btTypedConstraint* joint) { return isForeign(*joint); });
    return isOwn ? SolverRefusal::No : SolverRefusal::ForeignJoint;
}

SolverRefusal Solver::Parts::refusalOfStep(const btContactSolverInfo& info)
{
    if ((info.m_solverMode & SOLVER_RANDMIZE_ORDER) != 0)
        return SolverRefusal::RandomOrder;
    return WorkerSolver::hasBulletsRows(owner, info) ? SolverRefusal::No : SolverRefusal::ForeignRows;
}

void Solver::Parts::solveByBullet(SolverRefusal refusal, const SolverGroup& group,
                                  const btContactSolverInfo& info, btIDebugDraw* debugDrawer,
                                  btDispatcher* dispatcher)
{
    const bool isSetting = refusal == SolverRefusal::RandomOrder || refusal == SolverRefusal::ForeignRows;
    if (isSetting && !hasWarned)
        log(LogLevel::Warning, warningOf(refusal));
    hasWarned = hasWarned || isSetting;
    ++stats.groups;
    ++stats.refusedGroups;
    stats.refusal = refusal;
    owner.btSequentialImpulseConstraintSolver::solveGroup(group.bodies, group.bodyCount, group.manifolds,
                                                          group.manifoldCount, group.joints, group.jointCount,
                                                          info, debugDrawer, dispatcher);
}

/// @return false: no memory, and nothing has changed
bool Solver::Parts::tryToSolve(GroupSolver& solver, const SolverGroup& group, const btContactSolverInfo& info,
                               ParallelLoops& with)
{
    bool isSolved = true;
    with.runRegion(workOf(group, info),
                   [&]
                   {
                       try
                       {
                           solver.setUp(group, info, options, with);
                       }
                       catch (const std::bad_alloc&)
                       {
                           isSolved = false;
                       }
                       if (isSolved)
                           solver.solve(info, options, with);
                   });
    return isSolved;
}

/// Whether all threads solve the groups of a task together, or Bullet's solver some.
bool Solver::Parts::isAlone(const SolverTasks& what, unsigned task)
{
    if (what.tasks.taskWork(task) > std::max(kWideWork, kWideShare * what.tasks.work() / loops.threads()))
        return true;
    bool isForeignTask = false;
    what.tasks.forEachGroup(task,
                            [&](std::uint32_t number)
                            {
                                const SolverGroup group = groupOf(what, number);
                                isForeignTask = isForeignTask ||
                                                std::any_of(group.joints, group.joints + group.jointCount,
                                                            [](auto* joint) { return isForeign(*joint); });
                            });
    return isForeignTask;
}

void Solver::solveTasks(const SolverTasks& what)
{
    m->stats = {};
    const bool isRefused = m->refusalOfStep(what.info) != SolverRefusal::No;
    std::vector<unsigned>& shared = m->sharedTasks;
    shared.clear();
    for (unsigned task = 0; task < what.tasks.tasks(); ++task)
    {
        if (isRefused || m->loops.threads() == 1 || m->isAlone(what, task))
            what.tasks.forEachGroup(task, [&](std::uint32_t group) { m->solve(what, group); });
        else
            shared.push_back(task);
    }
    m->solveShared(what);
}

void Solver::Parts::solve(const SolverTasks& what, std::uint32_t group)
{
    solve(groupOf(what, group), what.info, what.debugDrawer, what.dispatcher);
}

/// Solves the groups of small tasks, each on one thread.
void Solver::Parts::solveShared(const SolverTasks& what)
{
    double work = 0;
    for (const unsigned task : sharedTasks)
        work += what.tasks.taskWork(task);
    while (solvers.size() < loops.threads())
        solvers.push_back(std::make_unique<GroupSolver>());
    failed.assign(what.groups.size(), 0);
    counts.assign(loops.threads(), {});
    ParallelLoops onOneThread(1);
    const auto solveTask = [&](unsigned index, unsigned thread)
    {
        const auto solveOne = [&](std::uint32_t group)
        {
            const bool isSolved = tryToSolve(*solvers[thread], groupOf(what, group), what.info, onOneThread);
            failed[group] = isSolved ? 0 : 1;
            if (isSolved)
                count(*solvers[thread], counts[thread]);
        };
        what.tasks.forEachGroup(sharedTasks[index], solveOne);
    };
    loops.runRegion(work, [&] { loops.run(static_cast<unsigned>(sharedTasks.size()), solveTask); });
    for (const SolverStats& of : counts)
    {
        stats.groups += of.groups;
        stats.contacts += of.contacts;
        stats.joints += of.joints;
        stats.serialConstraints += of.serialConstraints;
    }
    for (std::uint32_t group = 0; group < failed.size(); ++group)
    {
        if (failed[group] != 0)
            solveByBullet(SolverRefusal::NoMemory, groupOf(what, group), what.info, what.debugDrawer,
                          what.dispatcher);
    }
}

void Solver::Parts::count(const GroupSolver& solver, SolverStats& into)
{
    ++into.groups;
    into.contacts += solver.contacts();
    into.joints += solver.joints();
    into.serialConstraints += solver.serialConstraints();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
