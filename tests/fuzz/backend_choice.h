// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/support/search_options.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace cullet::test
{
/// The bits of some bytes as choices, from the lowest on.
class OptionBits
{
public:
    explicit OptionBits(std::uint32_t bits) : m_bits(bits) {}

    /// One of a number of values, of as many bits as that takes.
    template <class T, std::size_t count>
    T of(const T (&values)[count])
    {
        std::uint32_t width = 0;
        while ((std::size_t{1} << width) < count)
            ++width;
        const std::uint32_t index = m_bits & ((1u << width) - 1);
        m_bits >>= width;
        return values[index % count];
    }

    bool flag() { return of({false, true}); }

private:
    std::uint32_t m_bits;
};

template <class Options>
void chooseCells(OptionBits& bits, Options& options)
{
    options.bucketCount = bits.of({0u, 1u, 7u, 64u});
    options.cellScale = bits.of({0.0f, 1.0f, 20.0f, 0.5f});
    options.rebuildFraction = bits.of({-1.0f, 0.0f, 0.3f, 1.0f});
}

inline CellsOptions chosenCells(OptionBits bits)
{
    CellsOptions options;
    // The inputs of the corpus have the grid's choices here.
    bits.of({0, 1, 2, 3});
    bits.of({0, 1, 2, 3});
    chooseCells(bits, options);
    options.placement = bits.of({GridPlacement::AllCoarser, GridPlacement::OwnLevel, GridPlacement::OnePoint,
                                 GridPlacement::OneGrid});
    options.storage = bits.of({GridStorage::Chained, GridStorage::OpenAddressing, GridStorage::Array});
    options.updatesByRemoveAndAdd = bits.flag();
    options.countsPairs = bits.flag();
    return options;
}

inline GridOptions chosenGrid(OptionBits bits)
{
    GridOptions options;
    options.flatLimit = bits.of({GridOptions::kMeasured, 0u, 40u, 1u << 20});
    options.threads = bits.of({1, 1, 1, 2});
    chooseCells(bits, options);
    options.levels = bits.of({0u, 1u, 3u, 8u});
    options.settles = bits.of({true, false});
    options.baselineSimd = bits.flag();
    return options;
}

inline SearchOptions chosenSearch(OptionBits bits, bool isThesis)
{
    SearchOptions options;
    options.isThesis = isThesis;
    options.executor = bits.of(
        {PsapExecutor::InOrder, PsapExecutor::Shuffled, PsapExecutor::InOrder, PsapExecutor::Threads});
    options.threads = 2;
    constexpr int kPrincipal = -1;
    const int axis = bits.of({static_cast<int>(PsapAxis::Variance), static_cast<int>(PsapAxis::X),
                              static_cast<int>(PsapAxis::Y), static_cast<int>(PsapAxis::Z),
                              static_cast<int>(PsapAxis::Random), kPrincipal});
    options.isAxisPrincipal = axis == kPrincipal;
    options.axis = axis == kPrincipal ? PsapAxis::Variance : static_cast<PsapAxis>(axis);
    options.initialCapacity = bits.of({1024u, 1u});
    options.nearPairs = bits.of({PsapNearPairs::Automatic, PsapNearPairs::Never, PsapNearPairs::Always});
    if (isThesis)
    {
        options.isShifted = bits.flag();
        options.cells = bits.of({ThesisCells::Automatic, ThesisCells::Thesis, ThesisCells::FixedCount});
        options.cellCount = bits.of({1u, 20u, 5000u, 3u});
        options.bitStrings = bits.flag() && !options.isShifted;
        options.splitWork = bits.flag() && !options.isShifted;
        return options;
    }
    options.order = bits.of({PsapOrder::Automatic, PsapOrder::Counting, PsapOrder::Bins, PsapOrder::Tiles});
    options.rowSearch = bits.of({PsapRowSearch::Automatic, PsapRowSearch::Alone, PsapRowSearch::Grouped});
    options.updatesPerPlan = bits.of({0u, 1u});
    options.cellScale = bits.of({0.0f, 0.3f, 20.0f, 0.05f});
    options.binScale = bits.of({0.0f, 0.1f, 20.0f, 1.0f});
    return options;
}

/// A backend that runs on the CPU, of four bytes: the kind and its options. The grid for zeros.
inline std::unique_ptr<Backend> chosenBackend(Choices& choices)
{
    const std::uint32_t kind = choices.below(10);
    std::uint32_t word = 0;
    for (std::uint32_t shift = 0; shift < 24; shift += 8)
        word |= static_cast<std::uint32_t>(choices.byte()) << shift;
    const OptionBits bits(word);
    switch (kind)
    {
        case 2:
        case 3:
            return makeCellGridBackend(chosenCells(bits));
        case 4:
        case 5:
            return makeHostBackend(chosenSearch(bits, false));
        case 6:
            return makeHostBackend(chosenSearch(bits, true));
        case 7:
            return makeSapBackend();
        case 8:
            return makeLeGrandBackend();
        case 9:
            return makeBruteForceBackend();
        default:
            return makeGridBackend(chosenGrid(bits));
    }
}
}  // namespace cullet::test
