// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/solver/block_plan.h"
#include "cullet/plugin/solver/row_kernels.h"
#include "cullet/plugin/solver/row_storage.h"
#include "cullet/plugin/solver/shuffled_order.h"
#include "cullet/plugin/solver/solver_bodies.h"

#include <cstdint>
#include <vector>

class btManifoldPoint;
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
    /// Finds the manifolds that have a point and move a body, and adds their bodies.
    void collect(const btContactSolverInfo& info, btPersistentManifold** manifolds, int count,
                 SolverBodies& bodies);

    /// Plans the blocks, when all bodies are known, and reserves memory.
    void plan(const SolverStep& step, SolverBodies& bodies, const ParallelLoops& loops);

    std::uint32_t size() const { return static_cast<std::uint32_t>(m_contacts.size()); }
    const BlockPlan& plan() const { return m_plan; }
    /// Whether the application has given points a softness, or anchored them.
    bool hasOwnSoftness() const { return m_hasOwnSoftness; }

    /// Computes the rows, and applies the impulses of the warm start.
    void setUp(const SolverStep& step, const btContactSolverInfo& info, SolverBodies& bodies,
               ParallelLoops& loops);

    /// One iteration.
    ///
    /// @return the largest change of a velocity, squared; 0 unless the step notes it
    btScalar solve(const SolverStep& step, SolverBodies& bodies, ParallelLoops& loops);

    /// @name Soft steps
    ///@{
    void applyImpulses(const SolverStep& step, SolverBodies& bodies, ParallelLoops& loops) const;
    void solveSoft(const SolverStep& step, const SoftStep& substep, SolverBodies& bodies,
                   ParallelLoops& loops);
    void bounce(SolverBodies& bodies, ParallelLoops& loops);
    ///@}

    bool hasDeepPoints() const { return m_pushCount > 0; }
    /// One iteration of the split impulse.
    btScalar push(SolverBodies& bodies);

    /// Stores the impulses in the points.
    void writeBack(const SolverStep& step, ParallelLoops& loops) const;

private:
    struct Contact
    {
        btPersistentManifold* manifold;
        std::uint32_t a, b;   ///< numbers of its bodies
        std::uint32_t hash;   ///< of the numbers of its bodies in their island
        std::uint8_t points;  ///< those that count
        std::uint8_t deep;    ///< a bit for each of them
        std::uint8_t turns;   ///< a bit for each with turning friction
    };

    void add(const btContactSolverInfo& info, btPersistentManifold& manifold, SolverBodies& bodies);
    void notePoint(const btContactSolverInfo& info, const btManifoldPoint& point, int index,
                   Contact& contact);
    void layOut(const SolverStep& step, const SolverBodies& bodies);
    void fillLanes(const SolverBodies& bodies, const BlockPlan::Block& planned, ContactBlock& block);
    void readAhead(std::uint32_t index) const;
    void setUpBlock(const SolverStep& step, const btContactSolverInfo& info, SolverBodies& bodies,
                    std::uint32_t index);

    std::vector<Contact> m_contacts;  ///< in the order of the constraints
    ShuffledOrder<Contact> m_order;
    std::vector<BlockPlan::Constraint> m_constraints;
    BlockPlan m_plan;
    std::vector<ContactBlock> m_blocks;
    RowStorage<RowBlock> m_rows;
    RowStorage<PushBlock> m_pushes;
    std::uint32_t m_pushCount = 0;
    bool m_bounces = false;  ///< some point has a restitution
    bool m_hasOwnSoftness = false;
    std::vector<btScalar> m_residuals;  ///< [thread]
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
