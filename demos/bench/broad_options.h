// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/subject.h"
#include "cullet/demos/program/files/result_file.h"
#include "cullet/demos/program/files/trace_file.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Options of `cullet bench broad`.
struct BroadOptions
{
    std::vector<std::string> scenes = {"W1"};
    std::vector<std::uint32_t> bodies = {65536};
    std::vector<std::string> backends = {"grid", "dbvt"};
    std::vector<std::string> ids = {"random"};
    std::string through = "backend";
    int threads = 0;
    float margin = 0.05f;  ///< of held pairs, for cullet's backends; Bullet's broad phase has a global one
    int frames = 0;        ///< timed frames; 0: 12, or 10 from 200,000 bodies on
    int warmup = -1;       ///< frames before; negative: 12, or 4 from 200,000 bodies on
    double budget = 60.0;  ///< seconds that one backend may take in one case before its frames are cut short
    std::uint64_t seed = 12345;
    bool resend = false;         ///< set every box in every frame, also unmoved ones
    bool perFrame = false;       ///< also a row for each timed frame
    std::uint32_t queries = 0;   ///< per frame, for the scene "queries"; 0: 1, 100 and 100,000
    TraceFile* trace = nullptr;  ///< receives setBoxes and findPairs of every frame, warm-up included
    bool quiet = false;
};

/// One case of a benchmark: a scene at a number of bodies.
struct BroadCase
{
    const BroadOptions& options;
    std::string scene;
    std::uint32_t bodies;
    bool sortedIds;
};

/// The request for a backend in a case.
SubjectRequest requestFor(const BroadCase& benchCase, const std::string& backend, const ExactBox& bounds);

/// The columns that all rows of `bench broad` share, without the measured ones.
Json makeRow(const std::string& benchmark, const BroadCase& benchCase, const SubjectRequest& request,
             int threads);

/// Adds the measured columns: pairs, median_ms, p90_ms, min_ms, hash, mean_ms.
void addMeasurement(Json& row, const PairDigest& digest, const std::vector<double>& milliseconds);

/// Adds the columns of an update's counters: tests, entries, cells_touched, cells_visited, most_tests, false_pairs,
/// swaps_x, swaps_y, swaps_z.
void addCounters(Json& row, const BackendStats& counters, const ComparisonStats& compared);

/// Prints the most important columns of a row.
void printRow(const Json& row);

/// A bounding box of boxes, grown by a tenth of its size.
ExactBox boundsOf(const std::vector<Aabb>& boxes);
}  // namespace CULLET_PRECISION
}  // namespace cullet
