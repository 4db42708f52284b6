// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/solver/block_plan.h"
#include "cullet/plugin/solver/colour_loops.h"
#include "cullet/plugin/solver/row_kernels.h"
#include "cullet/plugin/solver/row_storage.h"
#include "cullet/plugin/solver/solver_bodies.h"

#include <cstdint>
#include <vector>

class btTypedConstraint;
struct btContactSolverInfo;
struct btSolverConstraint;

namespace cullet
{
class ParallelLoops;

inline namespace CULLET_PRECISION
{
/// The joints of a group and their rows, which the joints compute as for Bullet's solver (getInfo1(), getInfo2()).
class JointSet
{
public:
    /// Asks the joints for their rows, and adds their bodies.
    void collect(const btContactSolverInfo& info, btTypedConstraint** joints, int count, SolverBodies& bodies,
                 ParallelLoops& loops);

    /// Plans the blocks, when all bodies are known, and reserves memory.
    void plan(const SolverBodies& bodies);

    std::uint32_t size() const { return static_cast<std::uint32_t>(m_joints.size()); }
    const BlockPlan& plan() const { return m_plan; }

    /// Computes the rows.
    void setUp(const SolverStep& step, const btContactSolverInfo& info, SolverBodies& bodies,
               ParallelLoops& loops);

    /// The loop of one iteration.
    ///
    /// @param stride    iterations of the joints from one round to the next
    /// @param relaxes   whether errors cause no velocity, in a soft step
    /// @param residuals [thread] gets the largest change of a velocity, squared; 0 unless the step notes it
    ColourLoop solve(const SolverStep& step, int stride, bool relaxes, SolverBodies& bodies,
                     btScalar* residuals);

    /// The loop that applies the impulses of the last substep.
    ColourLoop applyImpulses(SolverBodies& bodies) const;

    /// Adds the impulses of a substep to their sums.
    void noteSubstep();
    /// Adds the impulses to their sums and sets them to zero, except those of motors and springs.
    void forgetImpulses();

    /// The number of iterations of the joint that asks for most; 0 without joints.
    int mostIterations() const { return m_mostIterations; }

    /// Tells the joints and their feedback what was applied, and breaks joints.
    void writeBack(const SolverStep& step, const btContactSolverInfo& info) const;

private:
    template <class Visit>
    void forEachRow(const Visit& visit);

    struct Joint
    {
        btTypedConstraint* joint;
        std::uint32_t a, b;
        int rows;
        int iterations;
    };

    void add(const btContactSolverInfo& info, btTypedConstraint& joint, int rows, SolverBodies& bodies);
    void layOut(const SolverBodies& bodies);
    btScalar solveBlock(const SolverStep& step, const JointBlock& block, int iteration, bool relaxes,
                        SolverBodies& bodies);
    void setUpBlock(const SolverStep& step, const btContactSolverInfo& info, SolverBodies& bodies,
                    std::uint32_t index);
    void readJoint(const btContactSolverInfo& info, const Joint& joint, int lane, JointBlock& block);
    void writeBack(const SolverStep& step, const btContactSolverInfo& info, const JointBlock& block,
                   int lane) const;

    std::vector<int> m_rowCounts;  ///< [joint of the group]
    std::vector<Joint> m_joints;
    std::vector<BlockPlan::Constraint> m_constraints;
    BlockPlan m_plan;
    std::vector<JointBlock> m_blocks;
    std::vector<std::uint32_t> m_places;  ///< [joint] kBlock * block + lane
    RowStorage<JointRowBlock> m_rows;
    int m_mostIterations = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
