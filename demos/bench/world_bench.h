// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/world_parts.h"
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
    bool mayRest = false;  ///< of worlds of their own, whose bodies may fall asleep
};

/// Options of `cullet bench world`.
struct WorldOptions
{
    std::string scene = "boxes";
    WorldSceneOptions world;  ///< its backend, narrow, update, threads and sleeping are ignored
    std::vector<WorldParts> parts;
    std::vector<int> threads = {0};  ///< each with each parts, except where parts have one thread
    std::vector<StepWindow> windows;
    TraceFile* trace = nullptr;  ///< receives the phases of all steps
    bool quiet = false;
};

/// Benchmark "world.<phase>.<window>": whole steps of a Bullet world, phase by phase, one world per parts and number of
/// threads, in turns of a few steps. A row per window, world and StepSample, and a table per window.
///
/// @throws ProgramError (kExitDisagreement) if, at the end of a window, a broad phase of cullet has other pairs than the
///         exact ones, or two worlds differ whose parts promise equal bits
void runWorldBench(const WorldOptions& options, ResultFile& file);
}  // namespace CULLET_PRECISION
}  // namespace cullet
