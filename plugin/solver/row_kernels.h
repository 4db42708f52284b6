// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/solver/point_source.h"

#include <cstddef>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The loops of the solver over the lanes of a block, compiled for an instruction set. None has fused products, and no
/// lane reads another one, so that all sets give the same bits.
struct RowKernels
{
    /// Reads the points of `source`, apart from what few points have (readRarities()).
    void (*readPoints)(const SolverStep& step, PointSource& source);

    /// Computes the rows of a block from its points, which may get directions of friction, and applies the impulses of
    /// the warm start.
    ///
    /// @param sources [point]
    /// @param motions [body] changes of velocities; changed
    void (*setUp)(const SolverStep& step, const SolverBodyState* states, ContactBlock& block,
                  PointSource* sources, RowBlock* rows, PushBlock* pushes, SolverMotion* motions);

    /// One iteration over the normals' rows of blocks, none of which depends on the others unless they have one lane.
    ///
    /// @return the largest change of a velocity, squared; 0 unless the step notes it
    btScalar (*press)(const SolverStep& step, const ContactBlock* blocks, std::size_t count, RowBlock* rows,
                      SolverMotion* motions);

    /// One iteration over their rows of friction.
    btScalar (*rub)(const SolverStep& step, const ContactBlock* blocks, std::size_t count, RowBlock* rows,
                    SolverMotion* motions);

    /// Computes what is left of the rows of a block of joints.
    void (*setUpJoints)(const SolverStep& step, const SolverBodyState* states, JointBlock& block,
                        JointRowBlock* rows);

    /// One iteration over the rows of a block of joints.
    ///
    /// @param isActive 1 in lanes that take part; null: all do
    /// @param relaxes  whether errors cause no velocity, in a soft step
    btScalar (*solveJoints)(const SolverStep& step, const JointBlock& block, const BlockOf* isActive,
                            bool relaxes, JointRowBlock* rows, SolverMotion* motions);

    /// One iteration of the split impulse over the deep points of a block.
    btScalar (*push)(const ContactBlock& block, const RowBlock* rows, PushBlock* pushes,
                     SolverMotion* motions);

    /// @name Soft steps
    /// In which motions are velocities, not changes of them.
    ///@{
    /// Applies the impulses of all rows.
    void (*applyContacts)(const SolverStep& step, const ContactBlock& block, const RowBlock* rows,
                          SolverMotion* motions);
    void (*applyJoints)(const JointBlock& block, const JointRowBlock* rows, SolverMotion* motions);
    /// One iteration over the rows of blocks, as press().
    ///
    /// @param moved [body] how far bodies have moved in the step
    void (*solveSoft)(const SolverStep& step, const SoftStep& substep, const ContactBlock* blocks,
                      std::size_t count, RowBlock* rows, PushBlock* pushes, const SolverMotion* moved,
                      SolverMotion* motions);
    /// Makes points bounce that were pressed, after the last substep.
    void (*bounce)(const ContactBlock& block, RowBlock* rows, PushBlock* pushes, SolverMotion* motions);
    ///@}
};

/// Those for the widest registers of this processor.
const RowKernels& rowKernels();

// For tests; each only where the processor has the instructions.
const RowKernels& rowKernelsBaseline();
#if defined(__x86_64__)
const RowKernels& rowKernelsAvx2();
const RowKernels& rowKernelsAvx512();
#endif
}  // namespace CULLET_PRECISION
}  // namespace cullet
