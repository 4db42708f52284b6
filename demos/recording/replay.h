// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/program/files/result_file.h"
#include "cullet/demos/program/files/trace_file.h"
#include "cullet/demos/recording/player.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Options of `cullet replay` and `cullet verify`.
struct ReplayOptions
{
    std::string path;
    std::vector<std::string> backends;
    int threads = 0;
    std::uint64_t frames = 0;  ///< at most; 0: all
    bool quiet = false;
    std::string trace = {};  ///< file for a Chrome trace; empty: none
};

struct ReplayResult
{
    std::uint64_t frames = 0;
    /// Description of the first difference; empty if all players found the same pairs in all frames.
    std::string difference;
};

/// Prints the summary of a recording.
void printSummary(const std::string& path, const RecordingSummary& summary);

/// Plays a recording to all backends, frame by frame in turns, and adds rows "replay.setAabb" (all events applied),
/// "replay.calculateOverlappingPairs" and "replay.frame" (both) for each, in the form of all benchmarks.
///
/// `hash` is over the overlapping pairs of all frames; the pair sets are compared, outside of the times, in each frame.
/// Stops early, with the results so far, when the user interrupts.
/// @param trace receives every frame; null: none
ReplayResult runReplay(const ReplayOptions& options, ResultFile& file, TraceFile* trace = nullptr);

/// Compares the overlapping pairs of all players with those of the first, in each frame, and stops at the first
/// difference: frame, pair, the player that has it, and both boxes. Prints and adds a row "verify" for each player.
ReplayResult runVerify(const ReplayOptions& options, RecordingFile& recording,
                       const std::vector<std::unique_ptr<Player>>& players, ResultFile& file,
                       TraceFile* trace = nullptr);
}  // namespace CULLET_PRECISION
}  // namespace cullet
