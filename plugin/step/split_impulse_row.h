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
/// Solves a row of the split impulse as Bullet's scalar function or its function for SSE does, without the global counter
/// gNumSplitImpulseRecoveries, to which no two threads may add.
using SplitImpulseRow = btScalar (*)(btSolverBody& bodyA, btSolverBody& bodyB, const btSolverConstraint& row);

/// The function that rounds like the one of Bullet's library; null if the library was compiled with fused multiply-adds. Both
/// are compared with it once per process, on the calling thread.
///
/// @param isSimd whether the solver has SOLVER_SIMD
SplitImpulseRow splitImpulseRowOfBullet(bool isSimd);
}  // namespace CULLET_PRECISION
}  // namespace cullet
