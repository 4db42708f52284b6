// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/isa_gjk.h"

#include <atomic>
#include <cstdint>

namespace cullet::preload
{
/// What one broad phase did, or several together.
struct BroadphaseCounts
{
    std::atomic<std::uint64_t> queries{0};  ///< rays, sweeps and boxes; these may come from several threads
    std::uint64_t updates = 0;
    std::uint64_t bodies = 0;  ///< living ones
    std::uint64_t mostBodies = 0;
    std::uint64_t mostPairs = 0;
    double updateSeconds = 0;  ///< 0 unless a summary is asked for
};

/// The counts of `counts`, whose broad phase is `broadphase`, are part of the summary until end().
void begin(const BroadphaseCounts& counts, const Broadphase& broadphase);

/// To be called before they are destroyed; they stay part of the summary.
void end(const BroadphaseCounts& counts);

/// To be called before ISA-GJK is registered with a dispatcher, which sets the counters of an earlier one at the same
/// address to zero.
void beforeRegistration(const btCollisionDispatcher& dispatcher);
void afterRegistration(const btCollisionDispatcher& dispatcher, const IsaGjkRegistration& isaGjk);

/// Writes all that is known to stderr.
void writeSummary();
}  // namespace cullet::preload
