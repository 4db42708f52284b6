// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/solver.h"
#include "cullet/plugin/solver/contact_set.h"
#include "cullet/plugin/solver/joint_set.h"
#include "cullet/plugin/solver/solver_bodies.h"

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

/// Solves groups, one at a time, with memory that it keeps.
class GroupSolver
{
public:
    /// Reads a group and computes its rows. Throws std::bad_alloc, before any velocity has changed.
    ///
    /// @param loops whose threads share the group's blocks, here and in solve()
    void setUp(const SolverGroup& group, const btContactSolverInfo& info, const SolverOptions& options,
               ParallelLoops& loops);

    /// Solves what setUp() read, and changes bodies, points and joints.
    void solve(const btContactSolverInfo& info, const SolverOptions& options, ParallelLoops& loops);

    // Of the last group.
    std::uint32_t contacts() const { return m_contacts.size(); }
    std::uint32_t joints() const { return m_joints.size(); }
    /// Constraints that no other one of their colour can run beside.
    std::uint32_t serialConstraints() const
    {
        return m_contacts.plan().serialConstraints() + m_joints.plan().serialConstraints();
    }

private:
    void pushApart(const btContactSolverInfo& info);
    void iterate(const btContactSolverInfo& info, ParallelLoops& loops);
    void iterateJoints(int iterations, bool relaxes, ParallelLoops& loops);
    void takeSubsteps(const btContactSolverInfo& info, const SolverOptions& options, ParallelLoops& loops);

    SolverStep m_step;
    SolverBodies m_bodies;
    JointSet m_joints;
    ContactSet m_contacts;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
