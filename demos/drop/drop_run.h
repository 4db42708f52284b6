// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/drop/drop_parts.h"
#include "cullet/demos/program/files/result_file.h"

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
    WorldSceneOptions world;   ///< world.backend is the broad phase of all parts but stock
    bool fixedNarrow = false;  ///< world.narrow is the narrow phase of every part
    std::vector<DropPart> parts = {DropPart::Stock, DropPart::Broadphase, DropPart::Dispatcher,
                                   DropPart::World};
    std::uint32_t steps = 180;
    std::uint32_t auditEvery = 20;  ///< steps between two comparisons of the pairs; 0: never
    TraceFile* trace = nullptr;     ///< receives the phases of all steps
    bool quiet = false;
};

/// How often two values that must be equal were equal.
struct AuditCount
{
    std::uint32_t audits = 0;
    std::uint32_t equal = 0;

    void add(bool isEqual)
    {
        ++audits;
        equal += isEqual ? 1 : 0;
    }
    bool agrees() const { return equal == audits; }
};

/// Results of one of the worlds.
struct ContenderResult
{
    DropPart part = DropPart::Stock;
    std::string title;
    std::string backend;  ///< that was actually used
    bool isCullet = false;
    std::string narrow;
    std::string update;
    int threads = 1;
    std::vector<PhaseTimes> steps;
    AuditCount exact;         ///< its pairs that overlap against the exact pairs of its own boxes
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
    std::vector<ContenderResult> contenders;  ///< at least one, in the order of the parts
    AuditCount lockStep;  ///< DBVT and cullet, fresh, on one world's boxes against that world's pairs
    AuditCount update;    ///< the world with cullet::World against the one without it, bit by bit
    std::uint32_t bodies = 0;
    bool interrupted = false;

    bool agrees() const;
};

/// Steps a world for each part in alternating blocks of steps, and compares their pairs.
///
/// Stops early, with the results so far, when the user interrupts.
///
/// @throws std::invalid_argument for an unknown scene or backend
DropResult runDrop(const DropOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
