// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/step/worker_solver.h"

#include "cullet/plugin/step/split_impulse_row.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
bool WorkerSolver::hasBulletsRows(btSequentialImpulseConstraintSolver& solver,
                                  const btContactSolverInfo& info)
{
    // A pointer to a protected member is reached through the own class only.
    constexpr auto kMode = &WorkerSolver::m_cachedSolverMode;
    constexpr auto kSetup = &WorkerSolver::setupSolverFunctions;
    const bool isSimd = (info.m_solverMode & SOLVER_SIMD) != 0;
    if (solver.*kMode != info.m_solverMode)
    {
        (solver.*kSetup)(isSimd);
        solver.*kMode = info.m_solverMode;
    }
    struct Rows
    {
        btSingleConstraintRowSolver generic, lowerLimit;
    };
    const auto rowsWith = [](bool withSimd) -> Rows
    {
        WorkerSolver bullets;
        (bullets.*kSetup)(withSimd);
        return {bullets.getActiveConstraintRowSolverGeneric(),
                bullets.getActiveConstraintRowSolverLowerLimit()};
    };
    // Bullet chooses them by the mode and the processor alone.
    static const Rows scalar = rowsWith(false), simd = rowsWith(true);
    const Rows& bullets = isSimd ? simd : scalar;
    return solver.getActiveConstraintRowSolverGeneric() == bullets.generic &&
           solver.getActiveConstraintRowSolverLowerLimit() == bullets.lowerLimit;
}

void WorkerSolver::forgetGroups()
{
    m_calls = 0;
    m_lastGroup = 0;
    m_analyticsData.m_numSolverCalls = 0;
}

void WorkerSolver::noteGroup(std::uint32_t group)
{
    if (m_analyticsData.m_numSolverCalls == m_calls)
        return;
    m_calls = m_analyticsData.m_numSolverCalls;
    // Tasks are taken in another order than Bullet's.
    if (m_calls > 1 && group < m_lastGroup)
        return;
    m_lastGroup = group;
    m_lastRecord = m_analyticsData;
}

btScalar WorkerSolver::solveGroupCacheFriendlySetup(btCollisionObject** bodies, int numBodies,
                                                    btPersistentManifold** manifolds, int numManifolds,
                                                    btTypedConstraint** constraints, int numConstraints,
                                                    const btContactSolverInfo& info,
                                                    btIDebugDraw* debugDrawer)
{
    const btScalar result = btSequentialImpulseConstraintSolver::solveGroupCacheFriendlySetup(
        bodies, numBodies, manifolds, numManifolds, constraints, numConstraints, info, debugDrawer);
    // After Bullet's function, which sets its own one if the mode has changed.
    // Null only where no row of the split impulse is solved (hasForeignRounding() of world_islands.cpp).
    if (const SplitImpulseRow row = splitImpulseRowOfBullet((info.m_solverMode & SOLVER_SIMD) != 0))
        m_resolveSplitPenetrationImpulse = row;
    return result;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
