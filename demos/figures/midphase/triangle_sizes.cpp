// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/figures/midphase/triangle_sizes.h"

#include "cullet/demos/figures/midphase/triangle_motion.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/precision.h"
#include "cullet/demos/program/statistics.h"

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <iterator>
#include <utility>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
struct TriangleSubject
{
    const char* name;
    TriangleTimes (*measure)(const TriangleMotion& motion);
};

constexpr TriangleSubject kTriangleSubjects[] = {
    {"wide", timeWideTree},
    {"linear", [](const TriangleMotion& motion) { return timeLinearTree(motion, false); }},
    {"linear-refit", [](const TriangleMotion& motion) { return timeLinearTree(motion, true); }},
    {"device", [](const TriangleMotion& motion) { return timeDeviceTrees(motion, false); }},
    {"device-refit", [](const TriangleMotion& motion) { return timeDeviceTrees(motion, true); }},
};
constexpr int kRounds = 3;

void addSizeRow(const TriangleMotion& motion, const char* name, const TriangleTimes& times, ResultFile& file)
{
    // Of the last round, which has one frame of the motion after another.
    const double pairs = static_cast<double>(times.pairs) / motion.frameCount();
    const std::uint32_t triangles = TriangleMotion::kSheets * motion.triangles();
    const Statistics statistics = summarise(times.ms);
    std::printf("%8u triangles %-14s %9.4f ms a frame, %9.0f pairs\n", triangles, name, statistics.median,
                pairs);
    file.addRow({{"benchmark", "midphase.size"},
                 {"scene", "sheets"},
                 {"backend", name},
                 {"precision", ownPrecision()},
                 {"threads", 1},
                 {"bodies", triangles},
                 {"pairs", pairs},
                 {"median_ms", statistics.median},
                 {"p90_ms", statistics.p90},
                 {"min_ms", statistics.min},
                 {"hash", toHex(times.hash)},
                 {"frames", times.ms.size()}});
}

/// Rounds of all subjects, one after the other.
void measureSize(std::uint32_t triangles, bool isQuick, ResultFile& file)
{
    const TriangleMotion motion(triangles, isQuick ? 2 : 6);
    TriangleTimes all[std::size(kTriangleSubjects)];
    for (int round = 0; round < kRounds && !isInterrupted(); ++round)
    {
        for (std::size_t i = 0; i < std::size(kTriangleSubjects); ++i)
        {
            TriangleTimes times = kTriangleSubjects[i].measure(motion);
            times.ms.insert(times.ms.end(), all[i].ms.begin(), all[i].ms.end());
            all[i] = std::move(times);
        }
    }
    for (std::size_t i = 0; i < std::size(kTriangleSubjects); ++i)
    {
        if (!all[i].ms.empty())
            addSizeRow(motion, kTriangleSubjects[i].name, all[i], file);
    }
}
}  // namespace

void measureTriangleSizes(const FigureOptions& options, ResultFile& file)
{
    const std::vector<std::uint32_t> own = {1000, 4000, 16000, 64000, 256000, 1000000, 4000000};
    FigureClock clock(options, "midphase");
    for (const std::uint32_t triangles : sizesOf(options, own, 4000, 1000000))
    {
        if (clock.hasTimeFor(triangles))
            measureSize(triangles, options.quick, file);
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
