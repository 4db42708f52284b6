// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <string>

namespace cullet
{
/// The least bytes that an operation has to move, in device memory (read or written) and between device and CPU memory.
struct LeastBytes
{
    std::uint64_t device = 0, bus = 0;

    std::uint64_t all() const { return device + bus; }
};

/// Bytes that a device copies in a millisecond.
struct CopySpeed
{
    double device = 0;  ///< read and written
    double bus = 0;     ///< from pinned memory of the CPU

    /// Milliseconds to copy as many bytes; 0 where no speed is known.
    double floorOf(const LeastBytes& bytes) const;
};

/// Boxes in, pairs out.
LeastBytes leastForPairs(std::uint64_t bodies, std::uint64_t pairs);

/// Boxes in; pairs in and out.
LeastBytes leastForDeltas(std::uint64_t bodies, std::uint64_t pairs);

/// The work of update() in a frame.
struct UpdateWork
{
    std::uint64_t bodies = 0, moved = 0;
    std::uint64_t held = 0;     ///< pairs
    std::uint64_t changes = 0;  ///< pairs that entered or left
};

/// For a stage of BackendStats::stages; 0 for an unknown one.
///
/// upload: moved boxes over the bus, with their rows unless all move, and a scatter to their rows; sort: boxes in, a
/// record of 32 bytes out; settle: held pairs in and out, two boxes for each pair with a moved box; search: records in;
/// deltas: the changes over the bus.
LeastBytes leastForStage(const std::string& stage, const UpdateWork& work);
}  // namespace cullet
