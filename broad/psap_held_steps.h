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
    std::uint32_t stretch;  ///< as RowWays has it
};

/// Looks at near pair i of a new list for the first time: notes whether it is held from this update on, and sends it on
/// where it enters.
///
/// @pre the search has found pairs with skins no thinner than the margin, and SettleHeld has told of all pairs
struct JudgeHeld
{
    NearList near;
    std::uint8_t* isHeld;     ///< [near.room, out]
    const AlignedBox* boxes;  ///< with skins
    BoxHistory history;
    LookupTable held;  ///< the held pairs that boxes and filter words do not tell of
    float margin;
    std::uint64_t* added;  ///< how many pairs enter: void where there is not room for all near ones
    NearReport* report;    ///< [out]

    CULLET_HOST_DEVICE NearItem read(std::uint64_t i) const { return near.readPair(i); }

    CULLET_HOST_DEVICE NearVerdict operator()(const NearItem& item) const
    {
        return judgeFirst(item, boxes,
                          [&](IdPair pair, const Aabb& a, const Aabb& b)
                          {
                              const bool isEntering = enters(pair, a, b);
                              return FirstLook{isEntering, isEntering || isStaying(pair, a, b)};
                          });
    }

    CULLET_HOST_DEVICE void keep(std::uint64_t i, const NearItem& item, const NearVerdict& verdict) const
    {
        if (i == 0)
            tellCount();
        near.keep(i, item, verdict, isHeld);
    }

private:
    CULLET_HOST_DEVICE void tellCount() const
    {
        report->pairs = *near.count;
        if (*near.count > near.room)
            setAlike(added, kVoidCount);
    }

    CULLET_HOST_DEVICE bool enters(IdPair pair, const Aabb& a, const Aabb& b) const
    {
        return overlaps(a, b) && !history.wereOverlapping(overlapOf(a, b)) && history.isOpen(pair) &&
               history.passesFilters(pair) && !held.contains(pair);
    }

    /// @pre it does not enter
    CULLET_HOST_DEVICE bool isStaying(IdPair pair, const Aabb& a, const Aabb& b) const
    {
        if (overlaps(a, b) && history.passesFilters(pair))
            return true;
        return overlapsWithMargin(a, b, margin) && held.contains(pair);
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
