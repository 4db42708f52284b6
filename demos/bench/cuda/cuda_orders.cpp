// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/cuda/cuda_orders.h"

#include "cullet/demos/bench/cuda/cuda_pairs.h"
#include "cullet/demos/bench/cuda/cuda_sets.h"
#include "cullet/demos/program/interrupt.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
constexpr int kRounds = 3;
constexpr int kFramesOfRound = 33;  // planning runs in one of them

struct Order
{
    const char* variant;
    PsapOrder order;
    PsapRowSearch search;
};

// The automatic choice first.
constexpr Order kOrders[] = {
    {"rows", PsapOrder::Automatic, PsapRowSearch::Automatic},
    {"rows-bins", PsapOrder::Bins, PsapRowSearch::Automatic},
    {"rows-alone", PsapOrder::Counting, PsapRowSearch::Alone},
    {"rows-grouped", PsapOrder::Counting, PsapRowSearch::Grouped},
    {"rows-tiles", PsapOrder::Tiles, PsapRowSearch::Automatic},
};

bool isFaster(const CudaRow& a, const CudaRow& b)
{
    return a.gpuMs < b.gpuMs;
}

/// Returns the median round of each order.
std::vector<CudaRow> timeRounds(const FreshSets& sets, int frames)
{
    std::vector<std::vector<CudaRow>> rounds(std::size(kOrders));
    for (int round = 0; round < kRounds; ++round)
    {
        for (std::size_t i = 0; i < std::size(kOrders); ++i)
        {
            PsapOptions options;
            options.order = kOrders[i].order;
            options.rowSearch = kOrders[i].search;
            rounds[i].push_back(timePairs(sets, kOrders[i].variant, options, frames));
        }
    }
    std::vector<CudaRow> rows;
    for (std::vector<CudaRow>& ofOrder : rounds)
    {
        std::sort(ofOrder.begin(), ofOrder.end(), isFaster);
        rows.push_back(ofOrder[kRounds / 2]);
    }
    return rows;
}

/// Adds the rows of a scene. @return how many times as long as the best order the chosen one took
double timeScene(const FreshScene& scene, int frames, CudaTable& table)
{
    std::vector<CudaRow> rows = timeRounds(FreshSets(scene), frames);
    const CudaRow best = *std::min_element(rows.begin() + 1, rows.end(), isFaster);
    CudaRow& chosen = rows.front();
    chosen.overBest = chosen.gpuMs / best.gpuMs;
    for (const CudaRow& row : rows)
        table.add(row);
    std::printf("%-6s %u: chosen %.4f ms, best %.4f (%s), ratio %.3f\n", scene.name, scene.bodies,
                chosen.gpuMs, best.gpuMs, best.variant.c_str(), chosen.overBest);
    return chosen.overBest;
}
}  // namespace

void timeOrders(const CudaBenchOptions& options, CudaTable& table)
{
    double worst = 0;
    for (const FreshScene& kind :
         {FreshScene{"W1", 0, uniformBoxes}, {"W2", 0, boxesOfManySizes}, {"W3", 0, heapOfBoxes}})
    {
        for (const std::uint32_t bodies :
             {1u << 14, 1u << 15, 3u << 14, 1u << 16, 1u << 17, 1u << 18, 1u << 20})
        {
            if (options.selects(kind.name, bodies) && !isInterrupted())
                worst = std::max(worst, timeScene({kind.name, bodies, kind.make},
                                                  options.quick ? 5 : kFramesOfRound, table));
        }
    }
    std::printf("the choice takes at most %.3f times as long as the best\n", worst);
}
}  // namespace cullet
