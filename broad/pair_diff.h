// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/pair.h"

#include <vector>

namespace cullet
{
/// Writes what turns the pair list `before` into `after`.
///
/// @param before,after sorted, unique
/// @param delta        [out] overwritten; neither list may be part of it
/// Cost: O(before + after)
void diffSortedPairs(const std::vector<Pair>& before, const std::vector<Pair>& after, PairDelta& delta);

/// Replaces `pairs` by itself without delta.removed and with delta.added.
///
/// @param pairs [in, out] sorted, unique; holds all of delta.removed and none of delta.added
/// @param delta sorted, unique, disjoint
/// Cost: O(pairs + delta)
void applyDelta(std::vector<Pair>& pairs, const PairDelta& delta);

/// One update of a backend that finds all overlapping pairs afresh: applies the rules of Backend to the held pairs.
///
/// @param held        [in, out] pairs held since the last update; sorted, unique
/// @param overlapping every pair of valid boxes that overlap now; sorted, unique
/// @param mayEnter    bool(Pair), asked once for each pair of `overlapping` that is not held: the filter
/// @param mayStay     bool(Pair), asked once for each held pair that is not in `overlapping`: the margin
/// @param delta       [out] overwritten; sorted, unique, disjoint
/// Cost: O(held + overlapping)
template <class MayEnter, class MayStay>
void updateHeldPairs(std::vector<Pair>& held, const std::vector<Pair>& overlapping, MayEnter mayEnter,
                     MayStay mayStay, PairDelta& delta)
{
    delta.added.clear();
    delta.removed.clear();
    auto old = held.begin();
    const auto checkOld = [&]
    {
        if (!mayStay(*old))
            delta.removed.push_back(*old);
        ++old;
    };
    for (const Pair pair : overlapping)
    {
        while (old != held.end() && *old < pair)
            checkOld();
        if (old != held.end() && *old == pair)
            ++old;
        else if (mayEnter(pair))
            delta.added.push_back(pair);
    }
    while (old != held.end())
        checkOld();
    applyDelta(held, delta);
}
}  // namespace cullet
