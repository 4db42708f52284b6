// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/broad/psap/verlet/neighbour_steps.h"

#include <cstdint>

/// What becomes of held pairs, told by near pairs: the steps. Here pairs stay until a margin between their boxes is passed,
/// and enter only where a filter agrees.
namespace cullet::psap
{
/// What the CPU learns of near pairs.
struct NearReport
{
    std::uint64_t pairs;    ///< in the list; may be more than were written
    std::uint64_t lookups;  ///< held pairs that the table was to tell of
    std::uint32_t stretch;  ///< as RowWays has it
};

/// Held pairs as a list, of an update that may still be under way.
struct PairListView
{
    const RowPair* pairs;
    std::uint64_t room;
    const std::uint64_t* count;  ///< null: as many as there is room for

    CULLET_HOST_DEVICE bool has(std::uint64_t i) const { return count == nullptr || i < *count; }
};

/// Sends near pair i to the lists of the sets of boxes that it is held of.
struct SendHeld
{
    NearList near;
    const std::uint8_t* isHeld[2];  ///< of list 0 and 1; null: that list is not asked for

    struct Verdict
    {
        SentPair sent;
    };

    CULLET_HOST_DEVICE Verdict read(std::uint64_t i) const
    {
        if (!near.has(i))
            return {};
        return {{near.pairs[i], bitOf(0, i) | bitOf(1, i)}};
    }
    CULLET_HOST_DEVICE Verdict operator()(const Verdict& verdict) const { return verdict; }
    CULLET_HOST_DEVICE void keep(std::uint64_t, const Verdict&, const Verdict&) const {}

private:
    CULLET_HOST_DEVICE std::uint32_t bitOf(std::uint32_t list, std::uint64_t i) const
    {
        return isHeld[list] != nullptr && isHeld[list][i] != 0 ? 1u << list : 0u;
    }
};

/// Puts held pair i into the table where neither boxes nor filter words tell that it is held.
struct TellApart
{
    PairListView held;
    const Aabb* boxes;
    const Filter* filters;  ///< as BoxHistory has them
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

/// Looks at near pair i of a new list: how near it is, and whether it is held.
///
/// @pre skins are no thinner than the margin that pairs were held by, and TellApart is done
struct JudgeNear
{
    NearList near;
    std::uint8_t* isHeld;     ///< [near.room, out]
    const AlignedBox* boxes;  ///< with skins
    const Filter* filters;    ///< as BoxHistory has them
    LookupTable apart;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const NearItem item = near.readPair(i);
        const NearVerdict verdict =
            judgeFirst(item, boxes,
                       [&](RowPair pair, const Aabb& a, const Aabb& b)
                       {
                           const bool areTogether = overlaps(a, b) && passesFilters(filters, pair);
                           return FirstLook{false, areTogether || apart.contains(pair)};
                       });
        near.keep(i, item, verdict, isHeld);
    }
};

/// Frees slot i of the table, and tells of the list: it is void where the table was too small.
struct EndList
{
    LookupTable table;
    NearList near;
    NearReport* report;  ///< [out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        table.slots[i] = LookupTable::kFree;
        if (i != 0)
            return;
        report->lookups = *table.count;
        if (*table.count > table.limit())
            *near.count = kVoidCount;
        *table.count = 0;
        report->pairs = *near.count;
    }
};

/// Tells what has become of near pair i.
struct FollowHeld
{
    NearList near;
    const std::uint8_t* wasHeld;
    std::uint8_t* isHeld;  ///< [out] as it was, where boxes have gone too far
    const Aabb* boxes;
    const Filter* filters;  ///< as BoxHistory has them
    const std::uint32_t*
        sentRows;  ///< a bit for each row: without one in either, a pair is held as it was; null: any may differ
    float margin;
    const std::uint32_t* stretch;  ///< as RowWays has it
    NearReport* report;            ///< [out]

    /// A pair whose boxes have to be looked at.
    struct alignas(16) Open
    {
        RowPair pair;
        std::uint64_t place;  ///< index, and whether it was held in the lowest bit
    };

    CULLET_HOST_DEVICE NearItem read(std::uint64_t i) const { return near.read(i, wasHeld); }

    /// Held pairs that are surely together stay, and those that are surely apart and not held do not enter.
    CULLET_HOST_DEVICE bool isOpen(const NearItem& item) const
    {
        const float gone = floatOf(*stretch);
        const Sureness sureness(item.closeness, sureFrom(gone));
        // Apart, but within the margin, maybe; or together, but not for a filter that is another now.
        const bool isSure = item.wasHeld ? sureness.areTogether : sureness.areApart;
        const bool isAsked = item.isPair && gone <= kMostStretch && !isSure;
        return isAsked && mayDiffer(isAsked ? item.pair : RowPair{0, 0});
    }
    CULLET_HOST_DEVICE void keep(std::uint64_t i, const NearItem& item) const
    {
        if (i == 0)
            report->stretch = *stretch;
        if (item.isPair)
            isHeld[i] = item.wasHeld ? 1 : 0;
    }
    CULLET_HOST_DEVICE Open open(std::uint64_t i, const NearItem& item) const
    {
        return {item.pair, 2 * i + (item.wasHeld ? 1 : 0)};
    }
    CULLET_HOST_DEVICE SentPair look(const Open& open) const
    {
        const bool was = open.place % 2 != 0;
        const bool is = isHeldNow(open.pair, was);
        isHeld[open.place / 2] = is ? 1 : 0;
        if (open.place / 2 == 0)
            report->stretch = *stretch;
        return {open.pair, is == was ? 0u : is ? kToAdded : kToRemoved};
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
