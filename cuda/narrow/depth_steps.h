// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/cuda/narrow/exact_depth.h"
#include "cullet/cuda/narrow/hull_tables.h"
#include "cullet/cuda/narrow/pair_depth.h"
#include "cullet/cuda/narrow/pair_steps.h"
#include "cullet/cuda/narrow/pair_types.h"
#include "cullet/cuda/narrow/polytope.h"

#include <cstdint>

/// The steps that find the depths of pairs that overlap.
namespace cullet::convex
{
/// Pairs by how their depth was found.
struct DepthCounts
{
    std::uint32_t large = 0;  ///< by a large polytope
    std::uint32_t examined =
        0;  ///< their point by a search of the touching pair, their depth by all faces if necessary
    std::uint32_t unproved = 0;  ///< not: the hulls have no faces, and rounding breaks every polytope
};

/// The pairs that overlap, and their answers. Element k is of the pair with place overlaps[k].
struct OverlapLists
{
    const std::uint32_t* overlaps = nullptr;
    const std::uint32_t* overlapCount = nullptr;
    PairDepth* depths = nullptr;      ///< [room]
    PairContact* contacts = nullptr;  ///< [room]
    std::uint32_t room = 0;           ///< later overlaps are left out
    // Indices k in any order: no result depends on it.
    std::uint32_t* large = nullptr;     ///< [room] that need a large polytope
    std::uint32_t* examined = nullptr;  ///< [room] that no polytope answers
    DepthCounts* counts = nullptr;

    CULLET_HOST_DEVICE std::uint32_t count() const
    {
        const std::uint32_t all = *overlapCount;
        return all < room ? all : room;
    }
};

/// Expands the polytopes of pairs.
struct ExpandPolytopes
{
    PairReader reader;
    OverlapLists lists;
    PolytopeMemory memory;
    std::uint32_t capacity;

    CULLET_HOST_DEVICE DepthProof search(std::uint32_t k, std::uint32_t lane) const
    {
        ReadPair bodies;
        reader.read(reader.input.pairs[lists.overlaps[k]], bodies);
        const PosedPair<double> posed = bodies.posed<double>();
        PairDepth record;
        const DepthProof proof = DepthSearch(posed, memory, lane, capacity).run(record);
        lists.depths[k] = record;
        return proof;
    }

    CULLET_HOST_DEVICE void examineLater(std::uint32_t k) const
    {
        lists.examined[fetchAdd(&lists.counts->examined, 1)] = k;
    }
};

/// Finds the depths of most pairs. Called for each lane, which has a polytope of its own.
struct MeasureDepths
{
    ExpandPolytopes expand;

    CULLET_HOST_DEVICE void operator()(std::uint64_t lane) const
    {
        const OverlapLists& lists = expand.lists;
        for (std::uint64_t i = lane; i < lists.count(); i += expand.memory.lanes)
        {
            const auto k = static_cast<std::uint32_t>(i);
            const DepthProof proof = expand.search(k, static_cast<std::uint32_t>(lane));
            if (proof == DepthProof::Full)
                lists.large[fetchAdd(&lists.counts->large, 1)] = k;
            else if (proof != DepthProof::Whole)
                expand.examineLater(k);
        }
    }
};

/// Finds the depths of pairs whose polytopes have many vertices. Called for each lane.
struct MeasureLargeDepths
{
    ExpandPolytopes expand;

    CULLET_HOST_DEVICE void operator()(std::uint64_t lane) const
    {
        const OverlapLists& lists = expand.lists;
        for (std::uint64_t i = lane; i < lists.counts->large; i += expand.memory.lanes)
        {
            const std::uint32_t k = lists.large[i];
            if (expand.search(k, static_cast<std::uint32_t>(lane)) != DepthProof::Whole)
                expand.examineLater(k);
        }
    }
};

/// Finds what no polytope has found. Several lanes examine the features of a pair; finish() takes the least bound of
/// all.
struct ExamineDepths
{
    /// Lanes of a pair. Fixed, since a lane leaves out features above its own least bound.
    static constexpr std::uint32_t kLanes = 32;

    PairReader reader;
    SurfaceTables surfaces;
    OverlapLists lists;

    /// @param index of the pair in OverlapLists::examined
    CULLET_HOST_DEVICE LeastBound examine(std::uint64_t index, std::uint32_t lane) const
    {
        LeastBound least;
        ReadPair bodies;
        const std::uint32_t k = read(index, bodies);
        const PosedPair<double> posed = bodies.posed<double>();
        if (isProved(k, posed))
            return least;
        const FeatureDepths depths(posed, surfaces, bodies.a.hull, bodies.b.hull);
        const std::uint64_t features = depths.features();
        for (std::uint64_t i = lane; i < features; i += kLanes)
            depths.examine(i, least);
        return least;
    }

    CULLET_HOST_DEVICE void finish(std::uint64_t index, const LeastBound& least) const
    {
        ReadPair bodies;
        const std::uint32_t k = read(index, bodies);
        const PosedPair<double> posed = bodies.posed<double>();
        const PairDepth& found = lists.depths[k];
        const bool isExamined = least.bound.depth < double(INFINITY);
        const DepthBound bound =
            isExamined
                ? least.bound
                : DepthBound{{-double(found.normal[0]), -double(found.normal[1]), -double(found.normal[2])},
                             double(found.depth)};
        if (!isExamined && !isProved(k, posed))
            fetchAdd(&lists.counts->unproved, 1);
        lists.depths[k] =
            depthRecord(bound, isExamined ? 0.0 : double(found.gap), touchingPoint(posed, bound));
    }

private:
    CULLET_HOST_DEVICE std::uint32_t read(std::uint64_t index, ReadPair& bodies) const
    {
        const std::uint32_t k = lists.examined[index];
        reader.read(reader.input.pairs[lists.overlaps[k]], bodies);
        return k;
    }

    /// Whether the depth is known, and only the point is missing.
    CULLET_HOST_DEVICE bool isProved(std::uint32_t k, const PosedPair<double>& posed) const
    {
        return double(lists.depths[k].gap) <= DepthSearch::kGapAccepted * posed.size();
    }
};

/// Hands the counts to the CPU, and begins new ones.
struct HandOverDepthCounts
{
    DepthCounts* counts;
    DepthCounts* fetched;  ///< memory that the CPU reads

    CULLET_HOST_DEVICE void operator()(std::uint64_t) const
    {
        *fetched = *counts;
        *counts = {};
    }
};
}  // namespace cullet::convex
