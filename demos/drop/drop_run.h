// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "demos/drop/pair_audit.h"
#include "demos/program/result_file.h"
#include "demos/scenes/world_scene.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
struct DropOptions
{
    std::string scene = "drop";
    WorldSceneOptions world;  ///< world.backend is the broad phase of the first world
    std::uint32_t steps = 180;
    std::uint32_t auditEvery = 20;  ///< steps between two comparisons of the pairs; 0: never
    TraceFile* trace = nullptr;     ///< gets the phases of all steps
    bool quiet = false;
};

/// How often each pair of pair sets that has to be equal was equal.
struct AuditCounts
{
    std::uint32_t audits = 0;
    std::uint32_t culletExact = 0;  ///< cullet's world against the exact pairs of its own boxes
    std::uint32_t dbvtExact = 0;    ///< DBVT's world against the exact pairs of its own boxes
    std::uint32_t lockStep = 0;     ///< DBVT, cullet anew and cullet's world on the boxes of cullet's world

    bool agrees() const { return culletExact == audits && dbvtExact == audits && lockStep == audits; }
};

/// What one of the two worlds showed.
struct ContenderResult
{
    std::string name;     ///< broad phase
    std::string backend;  ///< that it really ran
    int threads = 1;
    std::vector<PhaseTimes> steps;
    std::uint64_t pairs = 0;  ///< at the end; a margin may keep more than overlap
    std::uint64_t overlappingPairs = 0;
    std::uint64_t contactPairs = 0;
    std::uint64_t bytes =
        0;  ///< of a broad phase with these boxes, see ShadowBroadphase::releaseAndMeasure()
    std::uint64_t stateHash = 0;
    double lowestHeight = 0.0;
};

struct DropResult
{
    ContenderResult cullet;
    ContenderResult dbvt;
    AuditCounts audits;
    std::uint32_t bodies = 0;
    bool interrupted = false;
};

/// Steps two worlds that differ in their broad phase only, in alternating blocks of steps, and compares their pairs.
///
/// Stops early, with what it has, when the user interrupts.
///
/// @throws std::invalid_argument for an unknown scene or backend
DropResult runDrop(const DropOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
