// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/program/files/result_file.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Options of `cullet bench mesh`.
struct MeshBenchOptions
{
    std::vector<std::string> shapes = {"sphere", "box",     "capsule",  "cylinder", "hull16",
                                       "hull64", "hull200", "compound", "gimpact",  "convex-mesh"};
    std::vector<std::string> meshes = {"0.5m",   "0.1m",           "5m",  "heightfield",
                                       "scaled", "multi-material", "flat"};
    std::vector<std::string> motions = {"rest", "sliding", "falling"};
    std::vector<std::string> narrow = {"bullet", "isa-gjk", "dispatcher"};
    int bodies = 36;
    int steps = 40;  ///< measured
    std::uint64_t seed = 1;
    bool quiet = false;
};

std::vector<std::string> meshMotionNames();

/// Benchmark "mesh.<motion>": the narrow phase of a step, on one thread, for each shape, mesh and motion. The worlds of
/// a case differ in their narrow phases and are stepped in turns; a row for each.
///
/// @pre all names are known
void runMeshBench(const MeshBenchOptions& options, ResultFile& file);

/// Benchmark "mesh.quality": what meshTrials() do to bodies, with each narrow phase; a row for each. They measure no
/// times.
void runMeshQuality(const MeshBenchOptions& options, ResultFile& file);
}  // namespace CULLET_PRECISION
}  // namespace cullet
