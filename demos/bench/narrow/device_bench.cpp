// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/device_bench.h"

#include "cullet/cuda/narrow/convex_pairs.h"
#include "cullet/cuda/narrow/hull_set.h"
#include "cullet/demos/bench/narrow/convex_motion.h"
#include "cullet/demos/bench/narrow/convex_on_cpu.h"
#include "cullet/demos/bench/narrow/convex_times.h"
#include "cullet/demos/program/bench_cases.h"
#include "cullet/demos/program/exit_code.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace cullet
{
namespace
{
constexpr std::uint32_t kMillionPairs = 1000000;
constexpr GapShares kUsual = {80, 15}, kCalm = {95, 4}, kApart = {100, 0}, kTouching = {0, 0};

struct Case
{
    ConvexMotionOptions motion;
    const char*
        query;  ///< booleans, depths or contacts; or ids: booleans, from the CPU's memory to the CPU's
};

bool isRoundTrip(const Case& one)
{
    return std::strcmp(one.query, "ids") == 0;
}

ConvexQuery queryOf(const std::string& name)
{
    ConvexQuery query;
    query.measureDepths = name == "depths";
    query.contactMargin = name == "contacts" ? kContactMargin : -1.0f;
    return query;
}

/// Sizes of lists and hulls, then other mixes and motions, then pairs that touch, then ways there and back.
std::vector<Case> cases(unsigned seed)
{
    std::vector<Case> all;
    const auto add = [&](std::uint32_t pairs, int vertices, GapShares shares, double degrees,
                         const char* query = "booleans") {
        all.push_back({{pairs, vertices, shares, degrees, pairs > kMillionPairs ? 4 : 8, seed}, query});
    };
    add(100000, 42, kUsual, 1.0);
    for (const int vertices : {8, 20, 42, 64, 162})
        add(kMillionPairs, vertices, kUsual, 1.0);
    add(kMillionPairs, 42, kCalm, 1.0);
    add(kMillionPairs, 42, kApart, 1.0);
    add(kMillionPairs, 42, kUsual, 0.05);
    add(kMillionPairs, 42, kCalm, 0.05);
    add(10 * kMillionPairs, 42, kUsual, 1.0);
    for (const char* const query : {"booleans", "depths", "contacts"})
        add(100000, 42, kTouching, 1.0, query);
    for (const int vertices : {8, 64, 162})
        add(100000, vertices, kTouching, 1.0, "contacts");
    add(kMillionPairs, 42, kUsual, 1.0, "contacts");
    for (const std::uint32_t pairs : {1000u, 10000u, 100000u, kMillionPairs})
    {
        add(pairs, 42, kUsual, 1.0, "ids");
        all.back().motion.isFirstAtRest = true;
    }
    return all;
}

std::string nameOf(const GapShares& shares)
{
    const int overlapping = 100 - shares.separated - shares.near;
    return std::to_string(shares.separated) + "/" + std::to_string(shares.near) + "/" +
           std::to_string(overlapping);
}

std::string messageNameOf(const Case& one)
{
    const ConvexMotionOptions& options = one.motion;
    return std::to_string(options.pairs) + " pairs, " + std::to_string(options.vertices) + " vertices, " +
           nameOf(options.shares) + ", " + one.query;
}

/// @param cpuMs of one thread; 0: not measured
void add(const Case& one, const ConvexTimes& times, double cpuMs, ResultFile& file)
{
    const ConvexMotionOptions& options = one.motion;
    const double perMicrosecond = options.pairs / (1000.0 * times.warmMs);
    std::printf("%9u %8d %9s %7.2f %9s %9.4f %9.4f %9.4f %9.0f", options.pairs, options.vertices,
                nameOf(options.shares).c_str(), options.degrees, one.query, times.warmMs, times.warmP90Ms,
                times.coldMs, perMicrosecond);
    if (cpuMs > 0)
        std::printf(" %9.4f", cpuMs);
    std::printf("\n");
    std::fflush(stdout);
    Json row = {{"benchmark", "narrow_device"},
                {"pairs", options.pairs},
                {"vertices", options.vertices},
                {"mix", nameOf(options.shares)},
                {"degrees", options.degrees},
                {"query", one.query},
                {"warm_ms", times.warmMs},
                {"warm_p90_ms", times.warmP90Ms},
                {"cold_ms", times.coldMs},
                {"pairs_per_us", perMicrosecond},
                {"bytes", times.bytes},
                {"failed", times.counts.failed},
                {"remembered", times.counts.remembered},
                {"doubtful", times.counts.doubtful},
                {"overlapping", times.counts.overlapping},
                {"large_depths", times.counts.largeDepths},
                {"examined_depths", times.counts.examinedDepths}};
    if (cpuMs > 0)
        row["cpu_ms"] = cpuMs;
    file.addRow(std::move(row));
}

void measure(const Case& one, int mostRepetitions, ResultFile& file)
{
    // To copy the poses of ten million pairs takes a tenth of a second.
    const int repetitions =
        one.motion.pairs > kMillionPairs ? std::min(mostRepetitions, 10) : mostRepetitions;
    const ConvexMotion motion(one.motion);
    if (!isRoundTrip(one))
    {
        add(one, timeConvexPairs(motion, repetitions, queryOf(one.query)), 0.0, file);
        return;
    }
    const ConvexTimes times = timeRoundTrips(motion, repetitions);
    add(one, times, timeOnOneThread(motion, std::min(repetitions, 7)), file);
}
}  // namespace

void runDeviceNarrowBench(const DeviceNarrowOptions& options, ResultFile& file)
{
    std::string why;
    if (!makeDeviceConvexPairs(HullSet(), 0, nullptr, &why))
        throw ProgramError(kExitUnavailable, why);
    std::printf("%9s %8s %9s %7s %9s %9s %9s %9s %9s %9s\n", "pairs", "vertices", "mix", "degrees", "query",
                "warm_ms", "p90_ms", "cold_ms", "pairs/us", "cpu_ms");
    std::vector<BenchCase> chosen;
    for (const Case& one : cases(options.seed))
    {
        if (one.motion.pairs <= options.mostPairs)
            chosen.push_back({messageNameOf(one), [=, &file] { measure(one, options.repetitions, file); }});
    }
    measureCases(chosen, file);
}
}  // namespace cullet
