// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/preload/dynamics_functions.h"

namespace cullet::preload
{
/// As Implementation has them, for solvers.
bool constructSolver(void* memory);
bool destroySolver(void* memory, DynamicsFunction how);

/// Writes how many solvers were made, and the most that one of them solved last.
void writeSolvers();
}  // namespace cullet::preload
