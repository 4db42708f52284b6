// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/cuda/cuda_extremes.h"

#include "cullet/demos/bench/cuda/cuda_pairs.h"
#include "cullet/demos/bench/cuda/cuda_sets.h"
#include "cullet/demos/bench/cuda/cuda_updates.h"
#include "cullet/demos/program/interrupt.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
constexpr std::uint32_t kMillion = 1u << 20;

struct Extreme
{
    FreshScene scene;
    std::vector<PsapAxis> forced;  ///< axes to sweep along, besides the automatic one
    bool isInTable = false;        ///< measured with the other scenes, except for these axes
};

std::vector<Extreme> extremes()
{
    return {{{"flat", kMillion, flatBoxes}, {PsapAxis::X}, true},
            {{"flat-y", kMillion, flatBoxesY}, {PsapAxis::Y}},
            {{"flat-z", kMillion, flatBoxesZ}, {PsapAxis::Z}},
            {{"line", kMillion, boxesOnOneLine}, {PsapAxis::X, PsapAxis::Y}},
            {{"cover", kMillion, boxesUnderOne}, {}}};
}

const char* suffixOf(PsapAxis axis)
{
    return axis == PsapAxis::X ? "-x" : axis == PsapAxis::Y ? "-y" : axis == PsapAxis::Z ? "-z" : "";
}

void timeAxis(const FreshSets& sets, PsapAxis axis, const CudaBenchOptions& options, CudaTable& table)
{
    PsapOptions rows;
    rows.axis = axis;
    table.add(timePairs(sets, std::string("rows") + suffixOf(axis), rows, options.framesFor(kMillion)));
    if (options.rowsOnly)
        return;
    ThesisOptions literal;
    literal.axis = axis;
    table.add(
        timeThesisPairs(sets, std::string("literal") + suffixOf(axis), literal, options.quick ? 3 : 20));
}

void timeExtreme(const Extreme& extreme, const CudaBenchOptions& options, CudaTable& table)
{
    const FreshSets sets(extreme.scene);
    if (!extreme.isInTable && !options.quick)
        table.add(timeGridPairs(sets));
    if (!extreme.isInTable)
        timeAxis(sets, PsapAxis::Variance, options, table);
    for (const PsapAxis axis : extreme.forced)
        timeAxis(sets, axis, options, table);
}
}  // namespace

void timeExtremes(const CudaBenchOptions& options, CudaTable& table)
{
    for (const Extreme& extreme : extremes())
    {
        if (options.selects(extreme.scene.name, kMillion) && !isInterrupted())
            timeExtreme(extreme, options, table);
    }
}
}  // namespace cullet
