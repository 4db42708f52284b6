// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/solver/block_plan.h"
#include "cullet/plugin/solver/colour_loops.h"
#include "cullet/plugin/solver/contact_list.h"
#include "cullet/plugin/solver/row_kernels.h"
#include "cullet/plugin/solver/row_storage.h"
#include "cullet/plugin/solver/solver_bodies.h"

#include <cstdint>
#include <vector>

class btPersistentManifold;

namespace cullet
{
class ParallelLoops;

inline namespace CULLET_PRECISION
{
/// The contacts of a group and their rows.
class ContactSet
{
public:
    /// Finds the contacts, and adds their bodies.
    void collect(const btContactSolverInfo& info, btPersistentManifold** manifolds, int count,
                 SolverBodies& bodies, ParallelLoops& loops);

    /// Plans the blocks, when all bodies are known, and reserves memory.
    void plan(const SolverStep& step, SolverBodies& bodies, ParallelLoops& loops);

    std::uint32_t size() const { return m_contacts.size(); }
    const BlockPlan& plan() const { return m_plan; }
    /// Whether the application has given points a softness, or anchored them.
    bool hasOwnSoftness() const { return m_contacts.hasOwnSoftness(); }

    /// Computes the rows, and applies the impulses of the warm start.
    void setUp(const SolverStep& step, const btContactSolverInfo& info, SolverBodies& bodies,
               ColourLoops& colours, ParallelLoops& loops);

    /// Adds the loops of one iteration.
    ///
    /// @param iterations rounds in which they do something
    /// @param residuals  [thread] gets the largest change of a velocity, squared; 0 unless the step notes it
    void addLoops(const SolverStep& step, int iterations, SolverBodies& bodies, btScalar* residuals,
                  std::vector<ColourLoop>& to);

    /// @name Soft steps
    ///@{
    ColourLoop applyImpulses(const SolverStep& step, SolverBodies& bodies) const;
    ColourLoop solveSoft(const SolverStep& step, const SoftStep& substep, SolverBodies& bodies);
    void bounce(SolverBodies& bodies, ColourLoops& colours, ParallelLoops& loops);
    ///@}

    bool hasDeepPoints() const { return !m_deepBlocks.empty(); }
    /// The loop of one iteration of the split impulse.
    ///
    /// @param residuals [thread] gets the largest change of a velocity, squared
    ColourLoop push(SolverBodies& bodies, btScalar* residuals);

    /// Stores the impulses in the points.
    void writeBack(const SolverStep& step, ParallelLoops& loops) const;

private:
    void layOut(const SolverStep& step, const SolverBodies& bodies, ParallelLoops& loops);
    void findDeepBlocks();
    /// A block whose lanes move a body each by a part of its own.
    struct SharedBody
    {
        std::uint32_t number, firstPart;
    };

    void splitBodies(SolverBodies& bodies);
    void fillBlock(const SolverBodies& bodies, std::uint32_t index, ContactBlock& block) const;
    void spreadShared(std::uint32_t block, SolverMotion* motions) const;
    template <class Visit>
    void forEachBlock(const BlockRange& range, SolverMotion* motions, const Visit& visit) const;
    template <class Solve>
    void forBlocks(const BlockRange& range, SolverMotion* motions, const Solve& solve) const;
    void setUpBlock(const SolverStep& step, const btContactSolverInfo& info, SolverBodies& bodies,
                    std::uint32_t index);
    void readAhead(const ContactBlock& block) const;
    void writeBlock(const SolverStep& step, const ContactBlock& block) const;

    ContactList m_contacts;
    std::vector<BlockPlan::Constraint> m_constraints;
    BlockPlan m_plan;
    std::vector<ContactBlock> m_blocks;
    std::uint32_t m_firstShared = 0;         ///< first block with a body that lanes share, if any
    std::vector<SharedBody> m_sharedBodies;  ///< [block - m_firstShared]
    RowStorage<RowBlock> m_rows;
    RowStorage<PushBlock> m_pushes;
    std::vector<std::uint32_t> m_deepBlocks;       ///< those with a deep point
    std::vector<BlockPlan::Colour> m_deepColours;  ///< of m_deepBlocks
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
