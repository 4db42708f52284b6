// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// cullet_convex_times [PAIRS [VERTICES...]]: times of queries of convex pairs on a device, for profilers too. First
// booleans, then contacts of pairs that all touch, a tenth as many, then the way from poses in the CPU's memory to the
// touching pairs there, beside one thread.

#include "cullet/demos/bench/narrow/convex_on_cpu.h"
#include "cullet/demos/bench/narrow/convex_times.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <vector>

namespace
{
using namespace cullet;

void print(const ConvexMotionOptions& options, const char* name = "booleans", const ConvexQuery& query = {})
{
    const ConvexMotion motion(options);
    const ConvexTimes times = timeConvexPairs(motion, 30, query);
    const GapShares& shares = options.shares;
    std::printf(
        "%-8s %8u pairs, %3d vertices, %2d/%2d/%2d, %.2f degrees: warm %.4f ms (p90 %.4f), cold %.4f ms, "
        "%llu "
        "bytes; "
        "failed %u, remembered %u, doubtful %u, overlapping %u, undecided %u, depths of large polytopes %u, "
        "by "
        "all faces %u\n",
        name, options.pairs, options.vertices, shares.separated, shares.near,
        100 - shares.separated - shares.near, options.degrees, times.warmMs, times.warmP90Ms, times.coldMs,
        static_cast<unsigned long long>(times.bytes), times.counts.failed, times.counts.remembered,
        times.counts.doubtful, times.counts.overlapping, times.counts.undecided, times.counts.largeDepths,
        times.counts.examinedDepths);
    std::fflush(stdout);
}

/// Booleans, depths, and depths with contacts of pairs that all touch.
void printTouching(ConvexMotionOptions options)
{
    options.shares = {0, 0};
    ConvexQuery query;
    print(options);
    query.measureDepths = true;
    print(options, "depths", query);
    query.contactMargin = kContactMargin;
    print(options, "contacts", query);
}

/// Of as many pairs, and a tenth, a hundredth and a thousandth as many.
void printRoundTrips(ConvexMotionOptions options)
{
    options.isFirstAtRest = true;
    const std::uint32_t most = options.pairs;
    for (const std::uint32_t part : {1000, 100, 10, 1})
    {
        options.pairs = std::max(most / part, 1u);
        const ConvexMotion motion(options);
        const ConvexTimes times = timeRoundTrips(motion, 30);
        const double cpuMs = timeOnOneThread(motion, 7);
        std::printf(
            "ids      %8u pairs, %3d vertices: warm %.4f ms (p90 %.4f), cold %.4f ms, one thread %.4f ms\n",
            options.pairs, options.vertices, times.warmMs, times.warmP90Ms, times.coldMs, cpuMs);
        std::fflush(stdout);
    }
}
}  // namespace

int main(int argc, char** argv)
{
    try
    {
        ConvexMotionOptions options;
        if (argc > 1)
            options.pairs = static_cast<std::uint32_t>(std::strtoul(argv[1], nullptr, 10));
        std::vector<int> vertices;
        for (int i = 2; i < argc; ++i)
            vertices.push_back(std::atoi(argv[i]));
        if (vertices.empty())
            vertices = {42, 64};
        for (const int count : vertices)
        {
            options.vertices = count;
            print(options);
        }
        options.vertices = vertices.front();
        const ConvexMotionOptions usual = options;
        options.degrees = 0.05;
        // Nearly all of the last is the test of axes.
        for (const GapShares& shares : {GapShares{95, 4}, GapShares{100, 0}})
        {
            options.shares = shares;
            print(options);
        }
        options.degrees = 1.0;
        options.pairs = (options.pairs + 9) / 10;
        for (const int count : vertices)
        {
            options.vertices = count;
            printTouching(options);
        }
        printRoundTrips(usual);
    }
    catch (const std::exception& error)
    {
        std::fprintf(stderr, "%s\n", error.what());
        return EXIT_FAILURE;
    }
    return EXIT_SUCCESS;
}
