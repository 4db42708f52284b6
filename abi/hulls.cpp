// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Functions of the C interface for queries of convex hulls; all in double.
#include "cullet/abi/hull_batch.h"
#include "cullet/abi/hull_queries.h"
#include "cullet/abi/status.h"

#include <algorithm>

using namespace cullet;
using namespace cullet::abi;

struct cullet_hull_cache
{
    GjkCache<double> cache;
};

namespace
{
/// The answer for one pair, with the cache of the caller or a temporary one.
cullet_hull_result query(HullQuery kind, const cullet_hull* a, const cullet_pose* poseA, const cullet_hull* b,
                         const cullet_pose* poseB, double maxDistance, cullet_hull_cache* cache)
{
    require(maxDistance >= 0, CULLET_ERROR_ARGUMENT, "max_distance: not negative and no NaN expected");
    const PosedHull<double> placedA = place(a, poseA), placedB = place(b, poseB);
    GjkCache<double> temporary;
    const cullet_hull_result answer =
        queryHulls(kind, placedA, placedB, maxDistance, cache != nullptr ? cache->cache : temporary);
    require(answer.state != CULLET_NOT_CONVERGED, CULLET_ERROR_NOT_CONVERGED,
            "the hulls are degenerate beyond double precision");
    return answer;
}
}  // namespace

cullet_status cullet_hull_create(const double* points, size_t stride, uint32_t count, cullet_hull** hull)
{
    return guarded(
        [&]
        {
            requirePointer(hull, "hull is NULL");
            *hull = makeHullHandle(points, stride, count).release();
            return CULLET_OK;
        });
}

uint32_t cullet_hull_vertex_count(const cullet_hull* hull)
{
    return hull == nullptr ? 0 : static_cast<uint32_t>(hull->hull.vertexCount());
}

void cullet_hull_destroy(cullet_hull* hull)
{
    delete hull;
}

cullet_status cullet_hull_cache_create(cullet_hull_cache** cache)
{
    return guarded(
        [&]
        {
            requirePointer(cache, "cache is NULL");
            *cache = new cullet_hull_cache{};
            return CULLET_OK;
        });
}

void cullet_hull_cache_destroy(cullet_hull_cache* cache)
{
    delete cache;
}

cullet_status cullet_hull_overlap(const cullet_hull* a, const cullet_pose* pose_a, const cullet_hull* b,
                                  const cullet_pose* pose_b, cullet_hull_cache* cache, int32_t* overlaps,
                                  double* axis)
{
    return guarded(
        [&]
        {
            requirePointer(overlaps, "overlaps is NULL");
            const cullet_hull_result answer = query(HullQuery::Overlap, a, pose_a, b, pose_b, 0, cache);
            *overlaps = answer.state == CULLET_OVERLAPPING;
            if (axis != nullptr)
                std::copy_n(answer.axis, 3, axis);
            return CULLET_OK;
        });
}

cullet_status cullet_hull_distance(const cullet_hull* a, const cullet_pose* pose_a, const cullet_hull* b,
                                   const cullet_pose* pose_b, double max_distance, cullet_hull_cache* cache,
                                   cullet_hull_result* result)
{
    return guarded(
        [&]
        {
            requireResult<sizeof(cullet_hull_result)>(result);
            writeResult(query(HullQuery::Distance, a, pose_a, b, pose_b, max_distance, cache), result);
            return CULLET_OK;
        });
}

cullet_status cullet_hull_penetration(const cullet_hull* a, const cullet_pose* pose_a, const cullet_hull* b,
                                      const cullet_pose* pose_b, cullet_hull_cache* cache,
                                      cullet_hull_result* result)
{
    return guarded(
        [&]
        {
            requireResult<sizeof(cullet_hull_result)>(result);
            writeResult(query(HullQuery::Penetration, a, pose_a, b, pose_b, 0, cache), result);
            return CULLET_OK;
        });
}

cullet_status cullet_hull_query_batch(const cullet_hull_batch* batch, const cullet_hull_results* results)
{
    return guarded(
        [&]
        {
            requirePointer(batch, "batch is NULL");
            requirePointer(results, "results is NULL");
            const auto knownBatch = readOptions<sizeof(cullet_hull_batch)>(batch);
            const auto knownResults = readOptions<sizeof(cullet_hull_results)>(results);
            return runHullBatch(knownBatch, knownResults) ? CULLET_OK : CULLET_SOME_NOT_CONVERGED;
        });
}
