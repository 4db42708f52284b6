// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "demos/program/result_file.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Steps from `first` to before `end`.
struct StepWindow
{
    std::string name;
    std::uint32_t first;
    std::uint32_t end;
};

/// Options of `cullet bench world`.
struct WorldOptions
{
    std::string scene = "boxes";  ///< or "hulls"
    std::uint32_t bodies = 16384;
    std::uint32_t hullPoints = 20;
    std::vector<std::string> backends = {"auto", "dbvt"};
    std::vector<std::string> narrow = {"bullet"};   ///< each with each backend
    std::vector<std::string> updates = {"bullet"};  ///< each with each of these
    int threads = 0;
    std::uint64_t seed = 1;
    std::vector<StepWindow> windows = {{"falling", 20, 30}, {"settled", 180, 200}};
    bool quiet = false;
};

/// Benchmark "world.<phase>.<window>": whole steps of a Bullet world, phase by phase, one world per backend,
/// narrow phase and update of the boxes, in turns step by step. Bodies never sleep. A row per window, world and StepSample.
void runWorldBench(const WorldOptions& options, ResultFile& file);
}  // namespace CULLET_PRECISION
}  // namespace cullet
