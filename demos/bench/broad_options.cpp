// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/broad_options.h"

#include "cullet/demos/program/precision.h"
#include "cullet/demos/program/statistics.h"

#include <algorithm>
#include <cstdio>

namespace cullet
{
inline namespace CULLET_PRECISION
{
SubjectRequest requestFor(const BroadCase& benchCase, const std::string& backend, const ExactBox& bounds)
{
    SubjectRequest request;
    request.name = backend;
    request.through = benchCase.options.through == "bullet" ? Through::Bullet : Through::Backend;
    request.threads = benchCase.options.threads;
    request.margin = benchCase.options.margin;
    request.bodies = benchCase.bodies;
    request.bounds = bounds;
    return request;
}

Json makeRow(const std::string& benchmark, const BroadCase& benchCase, const SubjectRequest& request,
             int threads)
{
    const char* through = isThroughBullet(request) ? "bullet" : "backend";
    return {{"benchmark", benchmark},
            {"scene", benchCase.scene},
            {"backend", request.name},
            {"precision", ownPrecision()},
            {"threads", threads},
            {"bodies", benchCase.bodies},
            {"pairs", 0},
            {"median_ms", 0.0},
            {"p90_ms", 0.0},
            {"min_ms", 0.0},
            {"hash", ""},
            {"mean_ms", 0.0},
            {"ids", benchCase.sortedIds ? "sorted" : "random"},
            {"through", isRival(request.name) ? "own" : through}};
}

void addMeasurement(Json& row, const PairDigest& digest, const std::vector<double>& milliseconds)
{
    const Statistics times = summarise(milliseconds);
    row["pairs"] = digest.count;
    row["median_ms"] = times.median;
    row["p90_ms"] = times.p90;
    row["min_ms"] = times.min;
    row["hash"] = toHex(digest.hash);
    row["mean_ms"] = times.mean;
}

void addCounters(Json& row, const BackendStats& counters, const ComparisonStats& compared)
{
    row["tests"] = counters.candidates;
    row["entries"] = counters.entries;
    row["cells_touched"] = compared.cellsTouched;
    row["cells_visited"] = counters.cellsVisited;
    row["most_tests"] = compared.mostTests;
    row["false_pairs"] = compared.falsePairs;
    row["swaps_x"] = compared.swaps[0];
    row["swaps_y"] = compared.swaps[1];
    row["swaps_z"] = compared.swaps[2];
    row["reason"] = counters.decision.reason;
    row["levels"] = counters.levels;
    row["strays"] = counters.decision.strays;
    row["cost"] = counters.decision.cost;
    row["other_cost"] = counters.decision.otherCost;
    row["cell_width"] = counters.decision.cellWidth;
    row["plan_cost"] = counters.decision.planCost;
    row["one_level_cost"] = counters.decision.oneLevelCost;
    row["all_levels_cost"] = counters.decision.allLevelsCost;
}

void printRow(const Json& row)
{
    std::printf("%-26s %-8s %-17s %-7s %-6s %9u bodies %9llu pairs  median %11.4f  p90 %11.4f  min %11.4f ms",
                row["benchmark"].get<std::string>().c_str(), row["scene"].get<std::string>().c_str(),
                row["backend"].get<std::string>().c_str(), row["through"].get<std::string>().c_str(),
                row["ids"].get<std::string>().c_str(), row["bodies"].get<unsigned>(),
                row["pairs"].get<unsigned long long>(), row["median_ms"].get<double>(),
                row["p90_ms"].get<double>(), row["min_ms"].get<double>());
    const unsigned long long tests = row.value("tests", 0ull);
    if (tests != 0)
        std::printf("  %8.2f tests a body", static_cast<double>(tests) / row["bodies"].get<double>());
    std::printf("  %s", row.value("hash", "").c_str());
    if (row.value("wrong_checks", 0) != 0)
        std::printf("  WRONG PAIRS in %d of %d checks", row["wrong_checks"].get<int>(),
                    row["checks"].get<int>());
    std::printf("\n");
    std::fflush(stdout);
}

ExactBox boundsOf(const std::vector<Aabb>& boxes)
{
    ExactBox bounds = toExactBox(kEmptyAabb);
    for (const Aabb& box : boxes)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            bounds.min[axis] = std::min<double>(bounds.min[axis], box.min[axis]);
            bounds.max[axis] = std::max<double>(bounds.max[axis], box.max[axis]);
        }
    }
    for (int axis = 0; axis < 3; ++axis)
    {
        const double slack = 0.1 * (bounds.max[axis] - bounds.min[axis]) + 1.0;
        bounds.min[axis] -= slack;
        bounds.max[axis] += slack;
    }
    return bounds;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
