// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/preload/world_functions.h"

namespace cullet::preload
{
/// As Implementation has them.
bool constructWorld(WorldClass kind, void* memory, const WorldArguments& arguments);
bool destroyWorld(void* memory, WorldFunction how);
void keepWorld(const char* what);

/// Writes how many worlds were made, and the largest last steps of theirs in parallel loops.
void writeWorlds();
}  // namespace cullet::preload
