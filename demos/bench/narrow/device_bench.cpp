// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/device_bench.h"

#include "cullet/cuda/narrow/convex_pairs.h"
#include "cullet/cuda/narrow/hull_set.h"
#include "cullet/demos/bench/narrow/convex_motion.h"
#include "cullet/demos/bench/narrow/convex_times.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
constexpr GapShares kUsual = {80, 15}, kCalm = {95, 4}, kApart = {100, 0};

/// Sizes of lists and hulls, then other mixes and motions.
std::vector<ConvexMotionOptions> cases(unsigned seed)
{
    constexpr std::uint32_t kMillion = 1000000;
    std::vector<ConvexMotionOptions> all = {{100000, 42, kUsual, 1.0, 8, seed}};
    for (const int vertices : {8, 20, 42, 64, 162})
        all.push_back({kMillion, vertices, kUsual, 1.0, 8, seed});
    all.push_back({kMillion, 42, kCalm, 1.0, 8, seed});
    all.push_back({kMillion, 42, kApart, 1.0, 8, seed});
    all.push_back({kMillion, 42, kUsual, 0.05, 8, seed});
    all.push_back({kMillion, 42, kCalm, 0.05, 8, seed});
    all.push_back({10 * kMillion, 42, kUsual, 1.0, 4, seed});
    return all;
}

std::string nameOf(const GapShares& shares)
{
    const int overlapping = 100 - shares.separated - shares.near;
    return std::to_string(shares.separated) + "/" + std::to_string(shares.near) + "/" +
           std::to_string(overlapping);
}

void add(const ConvexMotionOptions& options, const ConvexTimes& times, ResultFile& file)
{
    const double perMicrosecond = options.pairs / (1000.0 * times.warmMs);
    std::printf("%9u %8d %9s %7.2f %9.4f %9.4f %9.4f %9.0f\n", options.pairs, options.vertices,
                nameOf(options.shares).c_str(), options.degrees, times.warmMs, times.warmP90Ms, times.coldMs,
                perMicrosecond);
    std::fflush(stdout);
    file.addRow({{"benchmark", "narrow_device"},
                 {"pairs", options.pairs},
                 {"vertices", options.vertices},
                 {"mix", nameOf(options.shares)},
                 {"degrees", options.degrees},
                 {"warm_ms", times.warmMs},
                 {"warm_p90_ms", times.warmP90Ms},
                 {"cold_ms", times.coldMs},
                 {"pairs_per_us", perMicrosecond},
                 {"bytes", times.bytes},
                 {"failed", times.counts.failed},
                 {"remembered", times.counts.remembered},
                 {"doubtful", times.counts.doubtful},
                 {"overlapping", times.counts.overlapping}});
}
}  // namespace

void runDeviceNarrowBench(const DeviceNarrowOptions& options, ResultFile& file)
{
    std::string why;
    if (!makeDeviceConvexPairs(HullSet(), 0, nullptr, &why))
        throw ProgramError(kExitUnavailable, why);
    std::printf("%9s %8s %9s %7s %9s %9s %9s %9s\n", "pairs", "vertices", "mix", "degrees", "warm_ms",
                "p90_ms", "cold_ms", "pairs/us");
    for (const ConvexMotionOptions& one : cases(options.seed))
    {
        if (one.pairs > options.mostPairs || isInterrupted())
            continue;
        const ConvexMotion motion(one);
        add(one, timeConvexPairs(motion, options.repetitions), file);
    }
}
}  // namespace cullet
