// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/preload/dynamics_functions.h"

namespace cullet::preload
{
/// As Implementation has them, for worlds.
bool constructWorld(DynamicsClass kind, void* memory, const WorldArguments& arguments);
bool destroyWorld(void* memory, DynamicsFunction how);

/// Writes how many worlds were made, and the largest last steps of theirs in parallel loops.
void writeWorlds();
}  // namespace cullet::preload
