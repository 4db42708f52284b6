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

/// Writes how many worlds were made, and how much of them ran on several threads.
void writeWorlds();
}  // namespace cullet::preload
