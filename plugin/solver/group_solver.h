// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/solver/colour_loops.h"
#include "cullet/plugin/solver/contact_set.h"
#include "cullet/plugin/solver/joint_set.h"
#include "cullet/plugin/solver/solver_bodies.h"
#include "cullet/plugin/solver/solver_group.h"
#include "cullet/plugin/solver/solver_options.h"

#include <cstdint>
#include <vector>

struct btContactSolverInfo;

namespace cullet
{
class ParallelLoops;

inline namespace CULLET_PRECISION
{
/// What became of a group.
struct GroupReport
{
    enum class Outcome : std::uint8_t
    {
        None,  ///< not tried
        Solved,
        NoMemory,        ///< and nothing has changed
        NoMemoryForRest  ///< nothing has changed in islands of a divided group that hasOwnSoftness()
    };
    Outcome outcome = Outcome::None;
    int iterations = 0;  ///< with substeps: their number
    btScalar residual =
        -1;  ///< the largest change of a velocity in the last iteration, squared; -1: not asked for
    std::uint32_t contacts = 0, joints = 0;
    std::uint32_t serialConstraints =
        0;  ///< those of the colours whose blocks must be solved one after the other
};

/// Whether contacts of an island have a softness or an anchor of their own.
bool hasOwnSoftness(const SolverGroup& island);

/// Solves groups, one at a time, with memory that it keeps.
class GroupSolver
{
public:
    /// Solves a group, and gives bodies, points and joints what it found.
    ///
    /// Its islands are solved together, so that small ones share lanes. With SolverModel::Soft those that hasOwnSoftness() are
    /// solved by themselves, if there are others.
    ///
    /// @param loops whose threads share the group's blocks
    GroupReport solve(const SolverGroup& group, const btContactSolverInfo& info, const SolverOptions& options,
                      ParallelLoops& loops);

private:
    bool solveTogether(const SolverGroup& group, const btContactSolverInfo& info,
                       const SolverOptions& options, ParallelLoops& loops);
    void solveSelected(const SolverGroup& group, bool ownSoftness, const btContactSolverInfo& info,
                       const SolverOptions& options, ParallelLoops& loops);
    void collect(const SolverGroup& group, const btContactSolverInfo& info, ParallelLoops& loops);
    void solveCollected(const SolverGroup& group, const btContactSolverInfo& info,
                        const SolverOptions& options, ParallelLoops& loops);
    void setUp(const SolverGroup& group, const btContactSolverInfo& info, const SolverOptions& options,
               ParallelLoops& loops);
    void writeBack(const btContactSolverInfo& info, ParallelLoops& loops);
    void addToReport();
    void pushApart(const btContactSolverInfo& info, ParallelLoops& loops);
    void iterate(const btContactSolverInfo& info, ParallelLoops& loops);
    int runRounds(const btContactSolverInfo& info, const std::vector<ColourLoop>& round, int most,
                  bool mayEndEarly, ParallelLoops& loops);
    void iterateJoints(int iterations, bool relaxes, ParallelLoops& loops);
    void takeSubsteps(const btContactSolverInfo& info, const SolverOptions& options, ParallelLoops& loops);

    GroupReport m_report;
    IslandSelection m_selection;
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
