// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/narrow/convex_pairs.h"
#include "cullet/demos/bench/narrow/convex_motion.h"

#include <cstdint>

namespace cullet
{
/// A row of `bench narrow --device`, in milliseconds.
struct ConvexTimes
{
    double warmMs = 0, warmP90Ms = 0;  ///< median and ninth decile
    double coldMs = 0;                 ///< median of queries that remember nothing
    ConvexPairCounts counts;           ///< of the last warm query
    std::uint64_t bytes = 0;           ///< of device memory
};

/// Times queries of a motion that goes to and fro by the device's clock, from enqueue() to its last step. Before each frame the
/// L2 cache is flushed.
///
/// @param query what is asked for; its depths and contacts are checked after each frame, outside of the time
/// @throws std::runtime_error without a usable device, or where a planted depth is not found, a depth is not proved to
///     1e-4 of the size, or a contact is empty
ConvexTimes timeConvexPairs(const ConvexMotion& motion, int frames, const ConvexQuery& query = {});

/// Times the way from poses in the CPU's memory to the places of the pairs that overlap there, by the CPU's clock, of a motion
/// that goes to and fro. Before each frame the L2 cache is flushed.
///
/// Pairs, hulls and the first poses are on the device already. In each frame go over the bus, all in page-locked memory:
/// - up, the poses from ConvexMotion::firstMoving() on, 32 bytes each, in one copy: 32 MB for a million pairs whose first
///   bodies rest, else 64,
/// - down, a few words of counts, and 4 bytes for each pair that overlaps: 200 kB for 5 % of a million.
///
/// Timed are this copy, ConvexQuery::listOverlaps, the wait for it, and copyContacts() of the places.
///
/// @throws std::runtime_error without a usable device, or where other pairs overlap than are planted
ConvexTimes timeRoundTrips(const ConvexMotion& motion, int frames);
}  // namespace cullet
