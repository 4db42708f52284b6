// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/compounds/compound_stand.h"
#include "cullet/demos/program/files/result_file.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Options of `cullet bench compounds`.
struct CompoundBenchOptions
{
    std::vector<std::string> children = compoundChildNames();
    std::vector<std::string> others = compoundOtherNames();
    std::vector<std::string> motions = compoundMotionNames();
    std::vector<int> counts = {2, 8, 64, 1000};  ///< of children
    std::vector<std::string> narrow = {"bullet", "dispatcher"};
    int rounds = 6;
    std::uint64_t seed = 1;
    bool quiet = false;
};

/// Benchmark "compounds.<motion>": the dispatch of a step on one thread. A simulation with Bullet gives the poses of 20
/// steps, of 40 in a fall. Each narrow phase finds the contacts of these in turns; of each pose the least time of all
/// rounds after the first counts. A row for each.
///
/// @pre all names are known
void runCompoundBench(const CompoundBenchOptions& options, ResultFile& file);
}  // namespace CULLET_PRECISION
}  // namespace cullet
