// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/program/files/result_file.h"

#include <cstdint>
#include <string>

namespace cullet
{
struct CudaBenchOptions
{
    bool quick = false;      ///< fewer frames
    bool pairsOnly = false;  ///< no update()
    bool rowsOnly = false;   ///< no other variants
    bool sweep = false;      ///< widths of cells and lengths of bins too
    bool crossover = false;  ///< update() on small worlds instead, beside the grid on the CPU
    bool orders = false;     ///< every order of the fast search in sizes in between instead
    std::string only;        ///< scenes whose name, as W1-65536, contains that

    bool wants(const std::string& scene, std::uint32_t bodies) const
    {
        return (scene + "-" + std::to_string(bodies)).find(only) != std::string::npos;
    }

    /// Plans are begun every 32 frames, those of tiles every 256.
    int framesFor(std::uint32_t bodies) const { return quick ? 9 : bodies > 1u << 20 ? 30 : 96; }
};

/// Times the CUDA backend on the workloads that broad phases on GPUs are compared on.
///
/// GPU time by CUDA events around the complete pair set, boxes in and pairs out in device memory, fresh positions in every
/// frame (three sets in turn); end-to-end time by the CPU's clock around update(), boxes and deltas in the CPU's memory;
/// the stages of update() by events; how fast the device copies. A row for each, with a hash of the pairs, so that a
/// faster wrong answer is seen: rows of one scene that find all pairs (the CPU's grid among them up to 1M boxes), and those
/// whose boxes move alike, have to agree.
/// Columns: scene, variant, bodies, pairs, gpu_ms and end_to_end_ms (medians; 0: not measured), p90_ms and max_ms of the same
/// times, bytes of device memory held (of a copy: bytes copied), bytes_moved, floor_ms, times_floor, over_uniform,
/// over_best, late_frames, behind_ms, hash, cuda.
/// bytes_moved: of pairs the least, boxes in and pairs out; of update() what went over the bus in the last frame; of a
/// stage of it the least that it has to move (cuda_floor.h). floor_ms: what this device takes to copy as many, in its memory
/// or over the bus, by the rows of scene `copy`; times_floor: the time of the row in floors. over_uniform: over that of
/// the same variant in W1 with as many bodies; of one along an axis that was not measured there, of the one along its own.
/// over_best: of what is chosen, over the best order. late_frames: in which the search ran twice; both count.
/// behind_ms: what the device still does when an update is done, mean.
///
/// @throws ProgramError: kExitUnavailable without a device, or in a build without CUDA; kExitDisagreement where a hash is
///     not that of the rows before
void runCudaBench(const CudaBenchOptions& options, ResultFile& file);
}  // namespace cullet
