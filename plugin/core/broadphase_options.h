// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/plugin/core/precision.h"

#include <LinearMath/btScalar.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
enum class BackendChoice
{
    Auto,   ///< the grid; CUDA for worlds of at least deviceBodies bodies if a device is available
    Grid,   ///< the hierarchical hash grid on the CPU
    Brute,  ///< every box against every other: for tests and for worlds of a few dozen bodies
    Cuda    ///< CUDA; the grid, with a warning, if no device is available
};

struct BroadphaseOptions
{
    BackendChoice backend = BackendChoice::Auto;
    /// Threads of the CPU backends; 0: as many as the machine has. The pairs never depend on it.
    int threads = 0;
    GridOptions grid;  ///< a nonzero `threads` above takes precedence over grid.threads
    PsapOptions psap;
    /// BackendChoice::Auto: a world with at least this many bodies moves to CUDA, and back to the grid below half of
    /// that; its pairs are kept. 0: CUDA from the start. The break-even measured on an H200 is at 500 to 2,000 bodies.
    std::uint32_t deviceBodies = 2048;
    /// A pair of separating boxes is kept until the boxes are 2 * margin apart (length unit of the world).
    /// Negative: Bullet's gDbvtMargin, read in every calculateOverlappingPairs().
    btScalar margin = btScalar(-1);
};

/// Counters for logs, tests and benchmarks.
struct BroadphaseStats
{
    std::uint32_t bodies = 0;  ///< live proxies
    std::uint32_t ghosts = 0;  ///< live proxies that are ghost objects, while a ghost callback is installed
    std::uint64_t pairs = 0;   ///< pairs in the pair cache
    /// Deferred pairs: overlaps that the cache lacks because the filter refused them or only the rounded boxes overlap.
    /// Those that the filter refused are listed, and counted, while they are few for the number of bodies.
    std::uint64_t pendingPairs = 0;
    /// Speculative pairs: pairs of ghosts that the backend has not reported yet.
    std::uint64_t provisionalPairs = 0;
    std::uint64_t invalidBoxesTotal = 0;     ///< boxes set with a NaN or min > max; they overlap nothing
    std::uint64_t updatesTotal = 0;          ///< calls of calculateOverlappingPairs
    std::uint64_t restartsTotal = 0;         ///< restarts of the backend from the pairs of the cache
    std::uint64_t fallbacksTotal = 0;        ///< backends that failed and were replaced by the grid
    std::uint64_t queryTreeBuildsTotal = 0;  ///< builds of the tree for rays and box queries
    /// Updates of that tree from changed boxes; other queries scanned the table or used the tree unchanged.
    std::uint64_t queryTreeSyncsTotal = 0;
    std::uint64_t bytes = 0;  ///< memory of proxies, tables and lists, without backend and pair cache
    const char* backendName = "";
    BackendStats backend;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
