// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/narrow/convex_pairs.h"
#include "cullet/demos/bench/narrow/convex_motion.h"

#include <cstdint>

namespace cullet
{
/// A row of `bench narrow --device`.
struct ConvexTimes
{
    double warmMs = 0,
           warmP90Ms = 0;  ///< median and ninth decile of the device's clock, from enqueue() to its last step
    double coldMs = 0;     ///< median of queries that remember nothing
    ConvexPairCounts counts;  ///< of the last warm query
    std::uint64_t bytes = 0;  ///< of device memory
};

/// Times queries of a motion that goes to and fro. Before each frame the L2 cache is flushed.
///
/// @param query what is asked for; its depths and contacts are checked after each frame, outside of the time
/// @throws std::runtime_error without a usable device, or where a planted depth is not found, a depth is not proved to
///     1e-4 of the size, or a contact is empty
ConvexTimes timeConvexPairs(const ConvexMotion& motion, int frames, const ConvexQuery& query = {});
}  // namespace cullet
