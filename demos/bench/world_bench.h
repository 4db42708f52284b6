// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/program/files/result_file.h"
#include "cullet/demos/program/files/trace_file.h"
#include "cullet/demos/scenes/bodies/world_scene.h"

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
    std::string scene = "boxes";
    WorldSceneOptions world;  ///< its backend, narrow and update are ignored; bodies never sleep
    std::vector<std::string> backends = {"auto", "dbvt"};
    std::vector<std::string> narrow = {"bullet"};   ///< each with each backend
    std::vector<std::string> updates = {"bullet"};  ///< each with each backend and narrow phase
    std::vector<StepWindow> windows = {{"falling", 20, 30}, {"settled", 180, 200}};
    TraceFile* trace = nullptr;  ///< receives the phases of all steps
    bool quiet = false;
};

/// Benchmark "world.<phase>.<window>": whole steps of a Bullet world, phase by phase, one world per backend,
/// narrow phase and update of the boxes, in turns step by step. A row per window, world and StepSample.
void runWorldBench(const WorldOptions& options, ResultFile& file);
}  // namespace CULLET_PRECISION
}  // namespace cullet
