// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/broad/psap/verlet/neighbour_steps.h"

#include <cstdint>

/// The steps that update held pairs with a neighbour list. Held pairs stay until a margin separates their boxes, and
/// pairs enter only where the filter accepts them.
namespace cullet::psap
{
/// What the device reports of a neighbour list.
struct NeighbourReport
{
    std::uint64_t pairs;         ///< in the list; may exceed the number that was written
    std::uint64_t lookups;       ///< hysteresis pairs, which need the table
    std::uint32_t displacement;  ///< as MotionRecorder::displacement
};

/// A list of held pairs, of an update that may not be complete.
struct PairListView
{
    const RowPair* pairs;
    std::uint64_t room;
    const std::uint64_t* count;  ///< null: `room` is the number of pairs

    CULLET_HOST_DEVICE bool has(std::uint64_t i) const { return count == nullptr || i < *count; }
};

/// Appends pair i of the neighbour list to the lists of the sets of boxes for which it is held.
struct AppendHeld
{
    NeighbourView neighbours;
    const std::uint8_t* isHeld[2];  ///< for list 0 and 1; null: that list is not needed

    struct Verdict
    {
        RoutedPair routed;
    };

    CULLET_HOST_DEVICE Verdict read(std::uint64_t i) const
    {
        if (!neighbours.has(i))
            return {};
        return {{neighbours.pairs[i], bitOf(0, i) | bitOf(1, i)}};
    }
    CULLET_HOST_DEVICE Verdict operator()(const Verdict& verdict) const { return verdict; }
    CULLET_HOST_DEVICE void keep(std::uint64_t, const Verdict&, const Verdict&) const {}

private:
    CULLET_HOST_DEVICE std::uint32_t bitOf(std::uint32_t list, std::uint64_t i) const
    {
        return isHeld[list] != nullptr && isHeld[list][i] != 0 ? 1u << list : 0u;
    }
};

/// Inserts held pair i into the table where it is a hysteresis pair: its boxes are separated, or its filter words
/// refuse it.
struct InsertHysteresisPairs
{
    PairListView held;
    const Aabb* boxes;
    const Filter* filters;  ///< as BoxHistory::filters
    LookupTable table;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        if (!held.has(i))
            return;
        const RowPair pair = held.pairs[i];
        if (!overlaps(loadBox(boxes, pair.a), loadBox(boxes, pair.b)) || !passesFilters(filters, pair))
            table.insert(pair);
    }
};

/// Tests pair i of a new list: its closeness, and whether it is held.
///
/// @pre skins are no thinner than the margin by which pairs are held, and InsertHysteresisPairs is complete
struct BeginHeld
{
    NeighbourView neighbours;
    std::uint8_t* isHeld;     ///< [neighbours.room, out]
    const AlignedBox* boxes;  ///< with skins
    const Filter* filters;    ///< as BoxHistory::filters
    LookupTable hysteresisPairs;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const NeighbourItem item = neighbours.readPair(i);
        const NeighbourVerdict verdict =
            classifyFirst(item, boxes,
                          [&](RowPair pair, const Aabb& a, const Aabb& b)
                          {
                              const bool areOverlapping = overlaps(a, b) && passesFilters(filters, pair);
                              return FirstVerdict{false, areOverlapping || hysteresisPairs.contains(pair)};
                          });
        neighbours.keep(i, item, verdict, isHeld);
    }
};

/// Clears slot i of the table, and completes the list: it is void where the table was too small.
struct FinishList
{
    LookupTable table;
    NeighbourView neighbours;
    NeighbourReport* report;  ///< [out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        table.slots[i] = LookupTable::kFree;
        if (i != 0)
            return;
        report->lookups = *table.count;
        if (*table.count > table.limit())
            *neighbours.count = kVoidCount;
        *table.count = 0;
        report->pairs = *neighbours.count;
    }
};

/// Tests whether pair i of the neighbour list is still held, enters or leaves.
struct FollowHeld
{
    NeighbourView neighbours;
    const std::uint8_t* wasHeld;
    std::uint8_t* isHeld;  ///< [out] unchanged where a box has left its skin
    const Aabb* boxes;
    const Filter* filters;  ///< as BoxHistory::filters
    /// A bit for each row: a pair can change only if one of its rows has it; null: any pair can.
    const std::uint32_t* sentRows;
    float margin;
    const std::uint32_t* displacement;  ///< as MotionRecorder::displacement
    NeighbourReport* report;            ///< [out]

    /// A pair whose boxes have to be loaded.
    struct alignas(16) Undecided
    {
        RowPair pair;
        std::uint64_t place;  ///< twice the index, plus 1 where the pair was held
    };

    CULLET_HOST_DEVICE NeighbourItem read(std::uint64_t i) const { return neighbours.read(i, wasHeld); }

    /// Held pairs whose closeness proves that they overlap stay; pairs that are proven separated and were not held do
    /// not enter.
    CULLET_HOST_DEVICE bool isUndecided(const NeighbourItem& item) const
    {
        const float gone = floatOf(*displacement);
        const ClosenessTest closenessTest(item.closeness, decisiveCloseness(gone));
        // A separated held pair may be within the margin, and an overlapping pair that is not held may now pass the
        // filter.
        const bool isDecided = item.wasHeld ? closenessTest.areOverlapping : closenessTest.areSeparated;
        const bool isCandidate = item.isPair && gone <= kMostDisplacement && !isDecided;
        return isCandidate && mayDiffer(isCandidate ? item.pair : RowPair{0, 0});
    }
    CULLET_HOST_DEVICE void keep(std::uint64_t i, const NeighbourItem& item) const
    {
        if (i == 0)
            report->displacement = *displacement;
        if (item.isPair)
            isHeld[i] = item.wasHeld ? 1 : 0;
    }
    CULLET_HOST_DEVICE Undecided undecided(std::uint64_t i, const NeighbourItem& item) const
    {
        return {item.pair, 2 * i + (item.wasHeld ? 1 : 0)};
    }
    CULLET_HOST_DEVICE RoutedPair classify(const Undecided& undecided) const
    {
        const bool was = undecided.place % 2 != 0;
        const bool is = isHeldNow(undecided.pair, was);
        isHeld[undecided.place / 2] = is ? 1 : 0;
        if (undecided.place / 2 == 0)
            report->displacement = *displacement;
        return {undecided.pair, is == was ? 0u : is ? kToAdded : kToRemoved};
    }

private:
    CULLET_HOST_DEVICE bool isHeldNow(RowPair pair, bool was) const
    {
        const Aabb a = loadBox(boxes, pair.a);
        const Aabb b = loadBox(boxes, pair.b);
        return was ? overlapsWithMargin(a, b, margin) : overlaps(a, b) && passesFilters(filters, pair);
    }

    CULLET_HOST_DEVICE bool mayDiffer(RowPair pair) const
    {
        return sentRows == nullptr || ((bitsFrom(pair.a) | bitsFrom(pair.b)) & 1u) != 0;
    }
    CULLET_HOST_DEVICE std::uint32_t bitsFrom(std::uint32_t row) const
    {
        return sentRows[row / 32] >> row % 32;
    }
};
}  // namespace cullet::psap
