// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Whether a joint is exactly of one of Bullet's classes, so that the solver's calls of it write to the joint and its
/// feedback only. Those of any other class may do anything, and belong on the thread of the application.
bool isBulletJoint(const btTypedConstraint& joint);
}  // namespace CULLET_PRECISION
}  // namespace cullet
