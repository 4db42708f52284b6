// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/events/event_scenes.h"
#include "cullet/demos/bench/frames_bench.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/scenes/extreme_scenes.h"

#include <algorithm>
#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Pairs per body of the balanced partner of a scene in which nearly all bodies overlap each other.
constexpr double kDensePairs = 32.0;

/// Scenes of boxScenes() that no partition divides well.
struct Extreme
{
    const char* name;
    double overlapping;  ///< share of all pairs of bodies that overlap, where that is large, else 0
};

constexpr Extreme kExtremes[] = {{"cell", 0.7}, {"line", 0},  {"diagonal", 0},
                                 {"point", 1},  {"cover", 0}, {"decades", 0}};

/// Number of bodies: that of the partner; fewer where their pairs would be too many for an even spread.
std::uint32_t bodiesOf(const Extreme& extreme, std::uint32_t bodies)
{
    if (extreme.overlapping == 0)
        return bodies;
    const double pairs = kDensePairs * bodies;
    return std::min(bodies,
                    static_cast<std::uint32_t>(std::lround(std::sqrt(2 * pairs / extreme.overlapping))));
}

double countPairs(const BoxScene& scene)
{
    std::vector<ExactBox> boxes;
    for (const Aabb& box : scene.boxes())
        boxes.push_back(toExactBox(box));
    return static_cast<double>(findExactPairs(boxes).size());
}

double ratio(const Json& row, const Json& balanced, const char* column)
{
    return row[column].get<double>() / std::max(balanced[column].get<double>(), 1e-9);
}

void runExtreme(const Extreme& extreme, const BroadCase& benchCase, ResultFile& file)
{
    const BoxSceneOptions options = {bodiesOf(extreme, benchCase.bodies), benchCase.sortedIds,
                                     benchCase.options.seed};
    const BoxSceneOptions balancedOptions = {benchCase.bodies, benchCase.sortedIds, benchCase.options.seed};
    std::vector<FramesCase> cases;
    cases.push_back({{benchCase.options, extreme.name, options.bodies, benchCase.sortedIds},
                     findBoxScene(extreme.name)->make(options)});
    const double pairs = countPairs(*cases.front().scene);
    cases.push_back(
        {{benchCase.options, std::string(extreme.name) + "-balanced", benchCase.bodies, benchCase.sortedIds},
         makeBalancedScene(balancedOptions, pairs)});
    std::vector<std::vector<Json>> rows = measureInTurn(cases);
    for (Json& row : rows[0])
    {
        const auto partner = std::find_if(
            rows[1].begin(), rows[1].end(),
            [&](const Json& other)
            { return other["benchmark"] == "broad.update" && other["backend"] == row["backend"]; });
        if (row["benchmark"] != "broad.update" || partner == rows[1].end())
            continue;
        const Json& balanced = *partner;
        row["cpu_ratio"] = ratio(row, balanced, "cpu_median_ms");
        row["wall_ratio"] = ratio(row, balanced, "median_ms");
        printRow(row);
        printRow(balanced);
        std::printf("  %s takes %.2f of the CPU time of the balanced scene\n", extreme.name,
                    row["cpu_ratio"].get<double>());
    }
    for (std::vector<Json>& each : rows)
    {
        for (Json& row : each)
            file.addRow(std::move(row));
    }
}
}  // namespace

void runExtremesBench(const BroadCase& benchCase, ResultFile& file)
{
    for (const Extreme& extreme : kExtremes)
    {
        if (!isInterrupted())
            runExtreme(extreme, benchCase, file);
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
