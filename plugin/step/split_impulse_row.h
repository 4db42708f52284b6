// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletDynamics/ConstraintSolver/btSolverBody.h>
#include <BulletDynamics/ConstraintSolver/btSolverConstraint.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A row of the split impulse, as Bullet's scalar function solves it, without its global counter gNumSplitImpulseRecoveries,
/// to which no two threads may add.
btScalar solveSplitImpulseRow(btSolverBody& bodyA, btSolverBody& bodyB, const btSolverConstraint& row);

/// Whether Bullet's library rounds like cullet's: it does unless it was compiled with fused multiply-adds or with SIMD rows.
/// Both functions above are compared once per process, on the calling thread.
///
/// @param isSimd whether the solver has SOLVER_SIMD
bool hasBulletsRounding(bool isSimd);
}  // namespace CULLET_PRECISION
}  // namespace cullet
