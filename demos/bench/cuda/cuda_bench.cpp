// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

#include "cullet/demos/bench/cuda/cuda_bench.h"

#include "cullet/broad/backend.h"
#include "cullet/cuda/device_pairs.h"
#include "cullet/demos/bench/cuda/cuda_ablation.h"
#include "cullet/demos/bench/cuda/cuda_deltas.h"
#include "cullet/demos/bench/cuda/cuda_drift.h"
#include "cullet/demos/bench/cuda/cuda_extremes.h"
#include "cullet/demos/bench/cuda/cuda_orders.h"
#include "cullet/demos/bench/cuda/cuda_pairs.h"
#include "cullet/demos/bench/cuda/cuda_sets.h"
#include "cullet/demos/bench/cuda/cuda_updates.h"
#include "cullet/demos/bench/cuda/support/cuda_table.h"
#include "cullet/demos/bench/cuda/support/cuda_timing.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/scenes/fresh_boxes.h"

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
void timeCrossover(CudaTable& table)
{
    for (std::uint32_t bodies = 512; bodies <= 1u << 15; bodies *= 2)
    {
        const FreshSets sets({"W1", bodies, uniformBoxes});
        GridOptions oneThread;
        oneThread.threads = 1;
        for (const std::uint32_t every : {1u, 10u})
        {
            const std::string suffix = every == 1 ? "-all-move" : "-tenth-moves";
            constexpr UpdateFrames kFrames = {kDriftWarmUps, 60};
            table.add(timeUpdates(sets, "rows-update" + suffix, makeCudaPsapBackend(), every, kFrames));
            table.add(timeUpdates(sets, "grid-update" + suffix, makeGridBackend(oneThread), every, kFrames));
            table.add(timeUpdates(sets, "grid-threads-update" + suffix, makeGridBackend(), every, kFrames));
        }
    }
}

// Where every tenth box moves, a neighbour list lasts for so many frames.
constexpr int kUpdateWarmUps = 80;

/// Adds a row for each stage of update() on the device; medians of the frames that run the stage.
void timeStages(const FreshSets& sets, PsapOptions options, const std::string& variant, std::uint32_t every,
                CudaTable& table)
{
    options.timeStages = true;
    StageSamples samples;
    const CudaRow whole =
        timeUpdates(sets, variant, makeCudaPsapBackend(options), every, {kUpdateWarmUps, 20}, &samples);
    for (const auto& [stage, times] : samples.times)
    {
        CudaRow row = whole;
        row.variant += "/" + stage;
        row.endToEndMs = 0;
        setTimes(row, &CudaRow::gpuMs, times);
        row.moved = leastForStage(stage, samples.work);
        table.add(row);
    }
}

void runScene(const FreshSets& sets, const CudaBenchOptions& options, CudaTable& table)
{
    const bool isQuick = options.quick;
    const bool isLarge = sets.scene().bodies > 1u << 20;
    const int frames = options.framesFor(sets.scene().bodies);
    if (!isQuick && !isLarge)
        table.add(timeGridPairs(sets));
    // These frames include one planning of tiles, and several other plannings, which show in the maximum.
    table.add(timePairs(sets, "rows", {}, 3 * frames));
    for (const char* variant : {kDriftingDeltas, kSearchedDeltas, kFreshDeltas})
        table.add(timeDeltas(sets, variant, isQuick ? 10 : 40));
    if (!options.rowsOnly)
        timeAblation(sets, isQuick ? 3 : 20, table);
    if (options.sweep && !isLarge)
        timeScales(sets, table);
    if (isLarge || options.pairsOnly)
        return;
    for (const std::uint32_t every : {1u, 10u})
    {
        const std::string suffix = every == 1 ? "-all-move" : "-tenth-moves";
        for (const PsapNearPairs nearPairs : {PsapNearPairs::Automatic, PsapNearPairs::Never})
        {
            PsapOptions updating;
            updating.nearPairs = nearPairs;
            const std::string variant =
                (nearPairs == PsapNearPairs::Never ? "rows-update-searched" : "rows-update") + suffix;
            table.add(timeUpdates(sets, variant, makeCudaPsapBackend(updating), every,
                                  {isQuick ? kDriftWarmUps : kUpdateWarmUps, isQuick ? 10 : 60}));
            if (!isQuick && sets.scene().bodies == 1u << 20)
                timeStages(sets, updating, variant, every, table);
        }
        GridOptions oneThread;
        oneThread.threads = 1;
        if (!isQuick)
            table.add(
                timeUpdates(sets, "grid-update" + suffix, makeGridBackend(oneThread), every, {kWarmUps, 5}));
    }
}

void measure(const CudaBenchOptions& options, CudaTable& table)
{
    const FreshScene scenes[] = {{"W1", 1u << 14, uniformBoxes}, {"W1", 1u << 16, uniformBoxes},
                                 {"W1", 1u << 20, uniformBoxes}, {"W2", 1u << 20, boxesOfManySizes},
                                 {"W3", 1u << 20, heapOfBoxes},  {"flat", 1u << 20, flatBoxes},
                                 {"W1", 1u << 24, uniformBoxes}};
    table.addCopies();
    if (options.crossover)
        return timeCrossover(table);
    if (options.orders)
        return timeOrders(options, table);
    for (const FreshScene& scene : scenes)
    {
        if (options.selects(scene.name, scene.bodies) && !isInterrupted())
            runScene(FreshSets(scene), options, table);
    }
    timeExtremes(options, table);
}
}  // namespace

void runCudaBench(const CudaBenchOptions& options, ResultFile& file)
{
    std::string why;
    if (makeDevicePairFinder({}, nullptr, &why) == nullptr)
        throw ProgramError(kExitUnavailable, why);
    try
    {
        CudaTable table(file);
        measure(options, table);
    }
    catch (const ProgramError&)
    {
        throw;
    }
    catch (const std::runtime_error& error)
    {
        throw ProgramError(kExitUnavailable, error.what());
    }
}
}  // namespace cullet
