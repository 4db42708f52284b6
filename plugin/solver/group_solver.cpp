// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver/group_solver.h"

#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>

#include <algorithm>
#include <limits>
#include <new>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Iterations of the joints alone, before the first substep's: once without and once with what forces add. With 4 of them,
/// twelve hanging beads never come to rest.
constexpr int kFirstJointSweeps = 24;

bool hasMode(const btContactSolverInfo& info, int mode)
{
    return (info.m_solverMode & mode) != 0;
}

SolverStep stepOf(const btContactSolverInfo& info)
{
    SolverStep step{};
    step.inverseTime = 1 / info.m_timeStep;
    step.relaxation = info.m_sor;
    step.warmStart = hasMode(info, SOLVER_USE_WARMSTARTING) ? info.m_warmstartingFactor : btScalar(0);
    step.pushBelow = info.m_splitImpulse ? info.m_splitImpulsePenetrationThreshold
                                         : -std::numeric_limits<btScalar>::infinity();
    step.bounceAbove = info.m_restitutionVelocityThreshold;
    step.anchorVelocity = info.m_frictionERP / info.m_timeStep;
    step.slop = info.m_linearSlop;
    step.softness = info.m_globalCfm / info.m_timeStep;
    step.errorReduction = info.m_erp2;
    step.slidingRows = hasMode(info, SOLVER_USE_2_FRICTION_DIRECTIONS) ? 2 : 1;
    step.slidesAlongVelocity = !hasMode(info, SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION);
    step.keepsSlides = !step.slidesAlongVelocity && step.slidingRows == 2;
    step.notesResidual = info.m_leastSquaresResidualThreshold > 0 || (info.m_reportSolverAnalytics & 1) != 0;
    step.interleaves = hasMode(info, SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS);
    step.share = 1;
    return step;
}

/// Friction has two directions, which do not change with the velocity, so that its impulses last.
SolverStep softStepOf(const btContactSolverInfo& info, int substeps)
{
    SolverStep step = stepOf(info);
    step.isSoft = true;
    step.share = 1 / btScalar(substeps);
    step.jointPasses = 2 * substeps;
    step.warmStart = hasMode(info, SOLVER_USE_WARMSTARTING) ? 1 : 0;
    step.relaxation = 1;
    step.slidingRows = 2;
    step.slidesAlongVelocity = step.keepsSlides = step.notesResidual = false;
    return step;
}

SoftContact softContact(btScalar frequency, btScalar damping, btScalar time)
{
    const btScalar turn = 2 * SIMD_PI * frequency;
    const btScalar resistance = 2 * damping + time * turn, stiffness = time * turn * resistance;
    return {turn / resistance, stiffness / (1 + stiffness), 1 / (1 + stiffness)};
}
}  // namespace

bool hasOwnSoftness(const SolverGroup& island)
{
    return std::any_of(island.manifolds, island.manifolds + island.manifoldCount,
                       [](const btPersistentManifold* manifold) { return hasOwnSoftness(*manifold); });
}

GroupReport GroupSolver::solve(const SolverGroup& group, const btContactSolverInfo& info,
                               const SolverOptions& options, ParallelLoops& loops)
{
    using Outcome = GroupReport::Outcome;
    m_report = {};
    Outcome onFailure = Outcome::NoMemory;
    try
    {
        if (!solveTogether(group, info, options, loops))
        {
            solveSelected(group, false, info, options, loops);
            onFailure = Outcome::NoMemoryForRest;
            solveSelected(group, true, info, options, loops);
        }
        m_report.outcome = Outcome::Solved;
    }
    catch (const std::bad_alloc&)
    {
        m_report.outcome = onFailure;
    }
    return m_report;
}

/// @return false, and nothing has changed, if the group must be divided
bool GroupSolver::solveTogether(const SolverGroup& group, const btContactSolverInfo& info,
                                const SolverOptions& options, ParallelLoops& loops)
{
    collect(group, info, loops);
    if (options.model == SolverModel::Soft && m_contacts.hasOwnSoftness() && GroupIslands::areMany(group))
        return false;
    solveCollected(group, info, options, loops);
    return true;
}

/// Solves the islands of a group whose contacts have a softness of their own, or those whose contacts have none.
void GroupSolver::solveSelected(const SolverGroup& group, bool ownSoftness, const btContactSolverInfo& info,
                                const SolverOptions& options, ParallelLoops& loops)
{
    const SolverGroup selected = m_selection.select(
        group, [&](const SolverGroup& island) { return hasOwnSoftness(island) == ownSoftness; });
    collect(selected, info, loops);
    solveCollected(selected, info, options, loops);
}

/// Finds the bodies and contacts.
void GroupSolver::collect(const SolverGroup& group, const btContactSolverInfo& info, ParallelLoops& loops)
{
    m_bodies.number(group.bodies, group.bodyCount, loops);
    m_contacts.collect(info, group.manifolds, group.manifoldCount, m_bodies, loops);
}

void GroupSolver::solveCollected(const SolverGroup& group, const btContactSolverInfo& info,
                                 const SolverOptions& options, ParallelLoops& loops)
{
    setUp(group, info, options, loops);
    if (m_step.isSoft)
    {
        takeSubsteps(info, options, loops);
    }
    else
    {
        pushApart(info, loops);
        iterate(info, loops);
    }
    // Allocates nothing from here on.
    writeBack(info, loops);
    addToReport();
}

void GroupSolver::setUp(const SolverGroup& group, const btContactSolverInfo& info,
                        const SolverOptions& options, ParallelLoops& loops)
{
    m_joints.collect(info, group.joints, group.jointCount, m_bodies, loops);
    m_step = options.model == SolverModel::Soft && !m_contacts.hasOwnSoftness()
                 ? softStepOf(info, options.substeps)
                 : stepOf(info);
    m_joints.plan(m_bodies);
    m_contacts.plan(m_step, m_bodies, loops);
    m_bodies.readStates(info, loops);
    m_joints.setUp(m_step, info, m_bodies, loops);
    m_contacts.setUp(m_step, info, m_bodies, m_colours, loops);
    m_residuals.resize(loops.threads());
}

void GroupSolver::writeBack(const btContactSolverInfo& info, ParallelLoops& loops)
{
    if (m_step.isSoft)
        m_bodies.writeBackMoved(info, loops);
    else
        m_bodies.writeBack(info, loops);
    if (hasMode(info, SOLVER_USE_WARMSTARTING))
        m_contacts.writeBack(m_step, loops);
    m_joints.writeBack(m_step, info);
}

void GroupSolver::addToReport()
{
    m_report.iterations = std::max(m_report.iterations, m_iterations);
    if (m_step.notesResidual)
        m_report.residual = std::max(m_report.residual, m_residual);
    m_report.contacts += m_contacts.size();
    m_report.joints += m_joints.size();
    m_report.serialConstraints += m_contacts.plan().serialConstraints() + m_joints.plan().serialConstraints();
}

/// The iterations that joints take part in, divided among the passes of a step.
void GroupSolver::iterateJoints(int iterations, bool relaxes, ParallelLoops& loops)
{
    const int stride = m_step.jointPasses;
    m_colours.run({m_joints.solve(m_step, stride, relaxes, m_bodies, m_residuals.data())}, 0,
                  (iterations + stride - 1) / stride, loops);
}

void GroupSolver::takeSubsteps(const btContactSolverInfo& info, const SolverOptions& options,
                               ParallelLoops& loops)
{
    const btScalar time = info.m_timeStep * m_step.share;
    // A spring that oscillates faster than a quarter of the substeps could not be followed.
    const btScalar frequency = std::min(options.contactFrequency, 1 / (4 * time));
    SoftStep substep{1 / time, options.pushSpeed, softContact(frequency, options.contactDamping, time),
                     softContact(2 * frequency, options.contactDamping, time), true};
    m_bodies.beginSubsteps(loops);
    // What joints forbid of the velocities is taken away once: as an impulse of the first substep it would be applied in
    // all of them, and chains of hinges would gain energy.
    m_colours.run({m_joints.solve(m_step, 0, true, m_bodies, m_residuals.data())}, 0, kFirstJointSweeps,
                  loops);
    m_joints.forgetImpulses();
    m_iterations = options.substeps;
    for (int i = 0; i < options.substeps; ++i)
    {
        m_bodies.addForces(i, m_step.share, loops);
        m_colours.run({m_joints.applyImpulses(m_bodies), m_contacts.applyImpulses(m_step, m_bodies)}, 0, 1,
                      loops);
        // Joints do not know their impulses of the last step.
        if (i == 0)
            m_colours.run({m_joints.solve(m_step, 0, false, m_bodies, m_residuals.data())}, 0,
                          kFirstJointSweeps, loops);
        for (const bool pushes : {true, false})
        {
            substep.pushes = pushes;
            iterateJoints(m_joints.mostIterations(), !pushes, loops);
            m_colours.run(m_contacts.solveSoft(m_step, substep, m_bodies), loops);
            if (pushes)
                m_bodies.move(time, loops);
        }
        m_joints.noteSubstep();
        m_bodies.endSubstep(i, m_step.share, time, loops);
    }
    m_contacts.bounce(m_bodies, m_colours, loops);
}

void GroupSolver::pushApart(const btContactSolverInfo& info, ParallelLoops& loops)
{
    if (m_contacts.hasDeepPoints())
        runRounds(info, {m_contacts.push(m_bodies, m_residuals.data())}, info.m_numIterations,
                  info.m_leastSquaresResidualThreshold > 0, loops);
}

void GroupSolver::iterate(const btContactSolverInfo& info, ParallelLoops& loops)
{
    std::vector<ColourLoop> round = {m_joints.solve(m_step, 1, false, m_bodies, m_residuals.data())};
    m_contacts.addLoops(m_step, info.m_numIterations, m_bodies, m_residuals.data(), round);
    m_iterations = runRounds(info, round, std::max(info.m_numIterations, m_joints.mostIterations()),
                             m_step.notesResidual, loops);
}

/// Runs loops again and again: all rounds at once, unless the change of one says whether another one follows.
///
/// @return the number of rounds
int GroupSolver::runRounds(const btContactSolverInfo& info, const std::vector<ColourLoop>& round, int most,
                           bool mayEndEarly, ParallelLoops& loops)
{
    m_residual = 0;
    const int step = mayEndEarly ? 1 : most;
    for (int first = 0; first < most; first += step)
    {
        std::fill(m_residuals.begin(), m_residuals.end(), btScalar(0));
        m_colours.run(round, first, step, loops);
        m_residual = *std::max_element(m_residuals.begin(), m_residuals.end());
        if (mayEndEarly && m_residual <= info.m_leastSquaresResidualThreshold)
            return first + 1;
    }
    return most;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
