// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/cuda/cuda_ablation.h"

#include "cullet/broad/backend.h"
#include "cullet/demos/bench/cuda/cuda_pairs.h"
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
// The number of cells of psap-1024 in `bench broad`.
constexpr std::uint32_t kFixedCells = 1024;
constexpr int kSlowFrames = 3;
// Larger worlds run only variants that take some milliseconds.
constexpr std::uint32_t kMaxBodiesForAll = 1u << 20;

template <class Options>
struct Variant
{
    const char* name;
    Options options;
    bool isForAnySize = false;
    bool isSlow = false;
};

PsapOptions ordered(PsapOrder order, PsapRowSearch search = PsapRowSearch::Automatic)
{
    PsapOptions options;
    options.order = order;
    options.rowSearch = search;
    return options;
}

ThesisOptions thesis(ThesisCells cells = ThesisCells::Automatic, bool isShifted = false)
{
    ThesisOptions options;
    options.isShifted = isShifted;
    options.cells = cells;
    options.cellCount = kFixedCells;
    return options;
}

ThesisOptions along(PsapAxis axis, std::uint32_t seed = 1)
{
    ThesisOptions options = thesis();
    options.axis = axis;
    options.seed = seed;
    return options;
}

ThesisOptions alongPrincipal()
{
    ThesisOptions options = thesis();
    options.isAxisPrincipal = true;
    return options;
}

ThesisOptions withBits()
{
    ThesisOptions options = thesis();
    options.bitStrings = true;
    return options;
}

ThesisOptions withSplit()
{
    ThesisOptions options = thesis();
    options.splitWork = true;
    return options;
}

std::vector<Variant<PsapOptions>> fastVariants()
{
    return {
        {"rows-counting", ordered(PsapOrder::Counting), true},
        {"rows-tiles", ordered(PsapOrder::Tiles), true},
        {"rows-alone", ordered(PsapOrder::Counting, PsapRowSearch::Alone)},
        {"rows-grouped", ordered(PsapOrder::Counting, PsapRowSearch::Grouped)},
    };
}

std::vector<Variant<ThesisOptions>> thesisVariants()
{
    return {
        {"literal", thesis(), true},
        {"literal-bits", withBits(), true},
        {"literal-split", withSplit(), true},
        {"literal-principal", alongPrincipal()},
        {"literal-x", along(PsapAxis::X)},
        // Seeds 1 and 2 choose x and z.
        {"literal-random-2", along(PsapAxis::Random, 2)},
        {"literal-1024-cells", thesis(ThesisCells::FixedCount)},
        {"shifted-1024-cells", thesis(ThesisCells::FixedCount, true)},
        // A long sweep, over many boxes in each cell.
        {"literal-thesis-cells", thesis(ThesisCells::Thesis), false, true},
        {"shifted-thesis-cells", thesis(ThesisCells::Thesis, true), false, true},
    };
}

template <class Options>
using TimePairs = CudaRow (*)(const FreshSets&, const std::string&, const Options&, int);

template <class Options>
void timeVariants(TimePairs<Options> time, const FreshSets& sets,
                  const std::vector<Variant<Options>>& variants, int frames, CudaTable& table)
{
    for (const Variant<Options>& variant : variants)
    {
        const bool isFor = variant.isForAnySize || sets.scene().bodies <= kMaxBodiesForAll;
        if (isFor && !isInterrupted())
            table.add(time(sets, variant.name, variant.options,
                           variant.isSlow ? std::min(frames, kSlowFrames) : frames));
    }
}
}  // namespace

void timeAblation(const FreshSets& sets, int frames, CudaTable& table)
{
    timeVariants(timePairs, sets, fastVariants(), frames, table);
    timeVariants(timeThesisPairs, sets, thesisVariants(),
                 sets.scene().bodies <= kMaxBodiesForAll ? frames : std::min(frames, kSlowFrames), table);
}

void timeScales(const FreshSets& sets, CudaTable& table)
{
    for (const float cell : {0.5f, 0.7f, 1.0f, 1.4f, 2.0f})
    {
        for (const float bin : {0.25f, 0.5f, 1.0f, 2.0f, 4.0f})
        {
            char name[64];
            std::snprintf(name, sizeof(name), "rows-%.1f-%.2f", cell, bin);
            PsapOptions options;
            options.cellScale = cell;
            options.binScale = bin;
            table.add(timePairs(sets, name, options, 9));
        }
    }
}
}  // namespace cullet
