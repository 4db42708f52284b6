// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Bullet's solver for one thread of several.
class WorkerSolver final : public btSequentialImpulseConstraintSolver
{
public:
    /// Whether a solver calls Bullet's functions for its rows, not some of the application. It takes over a changed solver
    /// mode first, as it does before it solves a group: Bullet's functions are set then.
    static bool hasBulletsRows(btSequentialImpulseConstraintSolver& solver, const btContactSolverInfo& info);

    /// To be called before the groups of a step.
    void forgetGroups();

    /// To be called after each group; keeps the record of the last one in Bullet's order that had iterations.
    void noteGroup(std::uint32_t group);

    /// Adds the records of all workers to the application's solver, which then says the same as after solving all
    /// groups itself.
    template <class Workers>
    static void report(const Workers& workers, btSequentialImpulseConstraintSolver& solver)
    {
        int calls = solver.m_analyticsData.m_numSolverCalls;
        const WorkerSolver* last = nullptr;
        for (const auto& worker : workers)
        {
            const bool isLater =
                worker->m_calls > 0 && (last == nullptr || worker->m_lastGroup > last->m_lastGroup);
            last = isLater ? worker.get() : last;
            calls += worker->m_calls;
        }
        if (last == nullptr)
            return;
        solver.m_analyticsData = last->m_lastRecord;
        solver.m_analyticsData.m_numSolverCalls = calls;
    }

protected:
    btScalar solveGroupCacheFriendlySetup(btCollisionObject** bodies, int numBodies,
                                          btPersistentManifold** manifolds, int numManifolds,
                                          btTypedConstraint** constraints, int numConstraints,
                                          const btContactSolverInfo& info,
                                          btIDebugDraw* debugDrawer) override;

private:
    int m_calls = 0;
    std::uint32_t m_lastGroup = 0;
    btSolverAnalyticsData m_lastRecord;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
