// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/convex/convex_world.h"

#include <string>
#include <vector>

namespace cullet::test
{
enum class HistoryScene;

/// A line with the hashes of a scene of bodies with all threads of the machine.
std::string worldHashes(const char* name, HistoryScene scene, Narrow narrow);

/// Hashes of what docs/determinism.md promises, a line each: pairs of boxes and queries of hulls, the same on every machine,
/// and pairs, contacts and boxes of a world, in which Bullet's library has a part.
std::vector<std::string> machineHashes();

/// The same lines as they were recorded. Put in new values only where pairs, queries or contacts were to change, and say in
/// the commit why.
const std::vector<std::string>& recordedHashes();
}  // namespace cullet::test
