// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/world_bench.h"
#include "cullet/demos/scenes/bodies/world_quality.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A world in a window of steps.
struct WindowSample
{
    std::vector<PhaseTimes> steps;
    std::vector<btVector3> firstPlaces;  ///< of the bodies, after the first step
    // At the end of the window.
    double drift = 0;                ///< mean way of a body since then, metres
    std::int64_t stepsToSleep = -1;  ///< of WorldRunner
    std::uint64_t pairs = 0;
    std::uint64_t contactPairs = 0;
    std::uint64_t stateHash = 0;
    WorldQuality quality;
};

struct WorldRunner
{
    const WorldParts* parts = nullptr;
    std::string title;  ///< parts, and threads where they may differ
    std::unique_ptr<WorldScene> world;
    std::vector<WindowSample> windows;  ///< [window of WorldOptions]
    /// After which of all steps 99 of 100 bodies were asleep and stayed so; -1: they are not.
    std::int64_t stepsToSleep = -1;
};

std::string titleOf(const WorldOptions& options, const WorldParts& parts, const WorldScene& world);

/// Prints a table of each window, and adds its rows to the file.
void reportWorlds(const WorldOptions& options, const std::vector<WorldRunner>& runners, ResultFile& file);
}  // namespace CULLET_PRECISION
}  // namespace cullet
