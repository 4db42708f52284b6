// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/abi/hull_batch.h"

#include "cullet/abi/hull_queries.h"
#include "cullet/abi/status.h"
#include "cullet/base/threads/parallel_loops.h"

#include <algorithm>
#include <atomic>

namespace cullet::abi
{
namespace
{
/// Pairs that a thread takes at a time: few, since some take fifty times as long as others.
constexpr std::size_t kPairsPerTask = 32;

/// Of a pair, for the number of threads that pay.
double nanosecondsOf(HullQuery query)
{
    return query == HullQuery::Overlap || query == HullQuery::Distance ? 1e3 : 1e4;
}

/// Requires every hull and pose to be usable.
void requireBodies(const cullet_bodies& bodies)
{
    require(bodies.reserved == 0, CULLET_ERROR_ARGUMENT, "bodies: reserved must be 0");
    if (bodies.count == 0)
        return;
    requirePointer(bodies.hulls, "hulls is NULL");
    for (std::uint32_t i = 0; i < bodies.count; ++i)
        place(bodies.hulls[i], bodies.poses == nullptr ? nullptr : bodies.poses + i);
}

/// Requires the pairs to name bodies.
void requirePairs(const cullet_hull_batch& batch)
{
    require(batch.pair_count <= 0xffffffffu, CULLET_ERROR_ARGUMENT, "pair_count: at most 2^32 - 1 expected");
    const std::uint64_t countA = batch.a.count, countB = batch.b.count;
    if (batch.pairs == nullptr)
    {
        const bool isMatch =
            (countA == batch.pair_count || countA == 1) && (countB == batch.pair_count || countB == 1);
        require(isMatch || batch.pair_count == 0, CULLET_ERROR_ARGUMENT,
                "without pairs: as many bodies as pairs expected, or one");
        return;
    }
    for (std::uint64_t i = 0; i < batch.pair_count; ++i)
        require(batch.pairs[i].first < countA && batch.pairs[i].second < countB, CULLET_ERROR_ARGUMENT,
                "a pair names a body that is not there");
}

HullQuery checkedQuery(std::int32_t query)
{
    require(query >= CULLET_QUERY_OVERLAP && query <= CULLET_QUERY_CONTACT, CULLET_ERROR_ARGUMENT,
            "query: one of CULLET_QUERY_* expected");
    return static_cast<HullQuery>(query);
}

PosedHull<double> bodyAt(const cullet_bodies& bodies, std::uint32_t index)
{
    return place(bodies.hulls[index], bodies.poses == nullptr ? nullptr : bodies.poses + index);
}

cullet_pair pairAt(const cullet_hull_batch& batch, std::uint32_t index)
{
    if (batch.pairs != nullptr)
        return batch.pairs[index];
    return {batch.a.count == 1 ? 0 : index, batch.b.count == 1 ? 0 : index};
}

void writeVector(const double (&vector)[3], std::size_t index, double* out)
{
    if (out != nullptr)
        std::copy_n(vector, 3, out + 3 * index);
}

void writePair(const cullet_hull_result& result, std::size_t index, const cullet_hull_results& results)
{
    if (results.states != nullptr)
        results.states[index] = result.state;
    if (results.distances != nullptr)
        results.distances[index] = result.distance;
    writeVector(result.axis, index, results.axes);
    writeVector(result.point_a, index, results.points_a);
    writeVector(result.point_b, index, results.points_b);
}

/// @return whether each of the pairs has an answer
bool runPairs(const cullet_hull_batch& batch, TaskRange range, const cullet_hull_results& results)
{
    bool areAnswered = true;
    for (std::uint32_t i = range.begin; i < range.end; ++i)
    {
        const cullet_pair pair = pairAt(batch, i);
        const PosedHull<double> a = bodyAt(batch.a, pair.first), b = bodyAt(batch.b, pair.second);
        // A new one for each pair, so that results do not depend on the order of pairs.
        GjkCache<double> cache;
        const cullet_hull_result result =
            queryHulls(static_cast<HullQuery>(batch.query), a, b, batch.max_distance, cache);
        areAnswered = areAnswered && result.state != CULLET_NOT_CONVERGED;
        writePair(result, i, results);
    }
    return areAnswered;
}
}  // namespace

bool runHullBatch(const cullet_hull_batch& batch, const cullet_hull_results& results)
{
    const HullQuery query = checkedQuery(batch.query);
    require(batch.max_distance >= 0, CULLET_ERROR_ARGUMENT, "max_distance: not negative and no NaN expected");
    require(batch.reserved == 0, CULLET_ERROR_ARGUMENT, "batch: reserved must be 0");
    ParallelLoops loops(checkedThreads(batch.threads));
    requireBodies(batch.a);
    requireBodies(batch.b);
    requirePairs(batch);
    const std::size_t count = batch.pair_count;
    const auto tasks = static_cast<unsigned>((count + kPairsPerTask - 1) / kPairsPerTask);
    std::atomic<bool> areAnswered{true};
    loops.runRegion(static_cast<double>(count) * nanosecondsOf(query),
                    [&]
                    {
                        loops.run(tasks,
                                  [&](unsigned task)
                                  {
                                      if (!runPairs(batch, TaskRange(count, task, tasks), results))
                                          areAnswered.store(false, std::memory_order_relaxed);
                                  });
                    });
    return areAnswered;
}
}  // namespace cullet::abi
