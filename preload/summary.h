// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/isa_gjk.h"

#include <atomic>
#include <cstdint>

namespace cullet::preload
{
/// Counts of one broad phase, or sums over several.
struct BroadphaseCounts
{
    std::atomic<std::uint64_t> queries{0};  ///< rays, sweeps and boxes; several threads may count
    std::uint64_t updates = 0;
    std::uint64_t bodies = 0;  ///< live proxies
    std::uint64_t mostBodies = 0;
    std::uint64_t mostPairs = 0;
    double updateSeconds = 0;  ///< 0 unless a summary is enabled
};

/// Makes `counts` and `broadphase`, to which they belong, a part of the summary.
void begin(const BroadphaseCounts& counts, const Broadphase& broadphase);

/// Call before `counts` and their broad phase are destroyed; the values stay part of the summary.
void end(const BroadphaseCounts& counts);

/// Call before ISA-GJK is registered with a dispatcher, which resets the counters of an earlier one at its address.
void beforeRegistration(const btCollisionDispatcher& dispatcher);
void afterRegistration(const btCollisionDispatcher& dispatcher, const IsaGjkRegistration& isaGjk);

/// Writes the summary of all broad phases and dispatchers to stderr.
void writeSummary();
}  // namespace cullet::preload
