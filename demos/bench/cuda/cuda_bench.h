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
    bool sweep = false;      ///< also widths of cells and lengths of bins
    bool crossover = false;  ///< instead, update() on small worlds, compared with the grid on the CPU
    bool orders = false;     ///< instead, every order of the fast search at sizes in between
    std::string only;        ///< only scenes whose name, such as W1-65536, contains this

    bool selects(const std::string& scene, std::uint32_t bodies) const
    {
        return (scene + "-" + std::to_string(bodies)).find(only) != std::string::npos;
    }

    /// Planning starts every 32 frames, that of tiles every 256.
    int framesFor(std::uint32_t bodies) const { return quick ? 9 : bodies > 1u << 20 ? 30 : 96; }
};

/// Times the CUDA backend on the workloads that broad phases on GPUs are compared on.
///
/// GPU time by CUDA events around the complete pair set, boxes in and pairs out in device memory, fresh positions in
/// every frame (three sets in turn); end-to-end time by the CPU's clock around update(), boxes and deltas in the CPU's
/// memory; the stages of update() by events; and the speed at which the device copies. Each has a row with a hash of
/// the pairs, so that a wrong answer is detected: rows of one scene that find all pairs (including the CPU's grid up to
/// 1M boxes), and rows whose boxes move alike, must agree. Columns: scene, variant, bodies, pairs, gpu_ms and
/// end_to_end_ms (medians; 0: not measured), p90_ms and max_ms of the same times, bytes of device memory held (of a
/// copy: bytes copied), bytes_moved, floor_ms, times_floor, over_uniform, over_best, late_frames, behind_ms, hash,
/// cuda.
/// bytes_moved: for pairs the minimum, boxes in and pairs out; for update() the bytes sent over the bus in the last
/// frame; for a stage of it the minimum (cuda_floor.h). floor_ms: the time in which this device copies that many bytes,
/// in its memory or over the bus, by the rows of scene `copy`; times_floor: time of the row / floor_ms. over_uniform:
/// time over that of the same variant in W1 with as many bodies; for a forced axis not measured there, over that of the
/// automatic axis. over_best: time of the chosen order over that of the best. late_frames: frames in which the search
/// ran twice; both runs count. behind_ms: mean time that the device still works after an update has returned.
///
/// @throws ProgramError: kExitUnavailable without a device, or in a build without CUDA; kExitDisagreement if a hash
///     differs from that of earlier rows
void runCudaBench(const CudaBenchOptions& options, ResultFile& file);
}  // namespace cullet
