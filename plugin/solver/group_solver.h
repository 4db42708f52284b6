// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/solver/colour_loops.h"
#include "cullet/plugin/solver/contact_set.h"
#include "cullet/plugin/solver/joint_set.h"
#include "cullet/plugin/solver/solver_bodies.h"
#include "cullet/plugin/solver/solver_options.h"

#include <cstdint>
#include <vector>

class btCollisionObject;
class btPersistentManifold;
class btTypedConstraint;
struct btContactSolverInfo;

namespace cullet
{
class ParallelLoops;

inline namespace CULLET_PRECISION
{
/// Bodies, contacts and joints that one call of btConstraintSolver::solveGroup() gets.
struct SolverGroup
{
    btCollisionObject** bodies;
    int bodyCount;
    btPersistentManifold** manifolds;
    int manifoldCount;
    btTypedConstraint** joints;
    int jointCount;
};

/// What became of a group.
struct GroupReport
{
    enum class Outcome : std::uint8_t
    {
        None,  ///< not tried
        Solved,
        NoMemory  ///< and nothing has changed
    };
    Outcome outcome = Outcome::None;
    int iterations = 0;  ///< with substeps: their number
    btScalar residual =
        -1;  ///< the largest change of a velocity in the last iteration, squared; -1: not asked for
    std::uint32_t contacts = 0, joints = 0;
    std::uint32_t serialConstraints =
        0;  ///< those of the colours whose blocks must be solved one after the other
};

/// Solves groups, one at a time, with memory that it keeps.
class GroupSolver
{
public:
    /// Reads a group and computes its rows. Throws std::bad_alloc.
    ///
    /// @param loops whose threads share the group's blocks, here and in the next two
    void setUp(const SolverGroup& group, const btContactSolverInfo& info, const SolverOptions& options,
               ParallelLoops& loops);

    /// Solves what setUp() read, and changes neither bodies nor points nor joints. Throws std::bad_alloc.
    void solve(const btContactSolverInfo& info, const SolverOptions& options, ParallelLoops& loops);

    /// Gives bodies, points and joints what solve() found. Allocates nothing.
    void writeBack(const btContactSolverInfo& info, ParallelLoops& loops);

    /// Of the last group.
    GroupReport report() const;

private:
    void pushApart(const btContactSolverInfo& info);
    void iterate(const btContactSolverInfo& info, ParallelLoops& loops);
    void iterateJoints(int iterations, bool relaxes, ParallelLoops& loops);
    void takeSubsteps(const btContactSolverInfo& info, const SolverOptions& options, ParallelLoops& loops);

    SolverStep m_step;
    int m_iterations = 0;
    btScalar m_residual = 0;
    SolverBodies m_bodies;
    JointSet m_joints;
    ContactSet m_contacts;
    ColourLoops m_colours;
    std::vector<btScalar> m_residuals;  ///< [thread]
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
