// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/psap_near_steps.h"
#include "broad/psap_pairs.h"

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

/// The pairs of an update that may still be under way: those that stay, and behind them those that enter.
struct HeldPairs
{
    const IdPair* pairs;
    std::uint64_t room;       ///< for all of them
    std::uint64_t addedRoom;  ///< for those that enter
    const ListCounts* counts;

    /// Whether they are all there.
    CULLET_HOST_DEVICE bool areComplete(const ListCounts& lists) const
    {
        return lists.added <= addedRoom && lists.kept + lists.added <= room;
    }
    CULLET_HOST_DEVICE bool has(std::uint64_t i) const
    {
        return areComplete(*counts) && i < counts->kept + counts->added;
    }
};

/// Puts held pair i into the table where neither boxes nor filter words tell that it is held.
struct TellApart
{
    HeldPairs held;
    const Aabb* boxes;
    const Filter* filters;  ///< as BoxHistory has them
    LookupTable table;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        if (!held.has(i))
            return;
        const IdPair pair = held.pairs[i];
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
                       [&](IdPair pair, const Aabb& a, const Aabb& b)
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
    std::uint8_t* isHeld;  ///< [out]
    const Aabb* boxes;
    const Filter* filters;  ///< as BoxHistory has them
    float margin;
    const std::uint32_t* stretch;  ///< as RowWays has it
    std::uint64_t* added;          ///< how many pairs enter: void where boxes have gone too far
    NearReport* report;            ///< [out]

    CULLET_HOST_DEVICE NearItem read(std::uint64_t i) const { return near.read(i, wasHeld); }

    CULLET_HOST_DEVICE NearVerdict operator()(const NearItem& item) const
    {
        const float gone = floatOf(*stretch);
        if (!(gone <= kMostStretch))
            return {};
        return NearVerdict::ofFollowed(item, isHeldNow(item, sureFrom(gone)));
    }

    CULLET_HOST_DEVICE void keep(std::uint64_t i, const NearItem& item, const NearVerdict& verdict) const
    {
        if (i == 0)
            tellStretch();
        if (item.isPair)
            isHeld[i] = verdict.isHeld ? 1 : 0;
    }

private:
    CULLET_HOST_DEVICE void tellStretch() const
    {
        report->stretch = *stretch;
        if (!(floatOf(*stretch) <= kMostStretch))
            *added = kVoidCount;  // no index counts any
    }

    CULLET_HOST_DEVICE bool isHeldNow(const NearItem& item, float sure) const
    {
        Sureness sureness(item.closeness, sure);
        // Within the margin, maybe.
        sureness.areApart &= !item.wasHeld;
        const IdPair asked = sureness.askFor(item.pair);
        const Aabb a = loadBox(boxes, asked.a);
        const Aabb b = loadBox(boxes, asked.b);
        if (item.wasHeld)
            return sureness.areTogether || overlapsWithMargin(a, b, margin);
        const bool areTogether = sureness.isOpen() ? overlaps(a, b) : sureness.areTogether;
        return areTogether && passesFilters(filters, item.pair);
    }
};
}  // namespace cullet::psap
