// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/pair.h"

#include <algorithm>
#include <cstdint>

namespace cullet
{
/// A pair and the rows of its boxes, for backends that would otherwise have to search for the rows.
struct KeyedPair
{
    Pair ids;
    std::uint32_t firstRow;   ///< row of ids.first
    std::uint32_t secondRow;  ///< row of ids.second
};

inline Pair idsOf(Pair pair) noexcept
{
    return pair;
}

inline Pair idsOf(const KeyedPair& pair) noexcept
{
    return pair.ids;
}

/// One update of a backend that finds all overlaps anew: applies the rules of Backend to the held pairs.
///
/// @param held        [in, out] vector of pairs held since the last update (Pair or KeyedPair); sorted by ids, unique
/// @param overlapping pairs of valid boxes that overlap now; sorted by ids, unique. Pairs of boxes neither of which
///                    changed may be left out.
/// @param mayEnter    bool(pair), called once for each pair of `overlapping` that is not held: the filter
/// @param mayStay     bool(pair), called once for each held pair that is not in `overlapping`: the margin
/// @param delta       [out] overwritten; sorted, unique, disjoint
/// Cost: O(held + overlapping)
template <class AnyPairs, class MayEnter, class MayStay>
void updateHeldPairs(AnyPairs& held, const AnyPairs& overlapping, MayEnter mayEnter, MayStay mayStay,
                     PairDelta& delta)
{
    using AnyPair = typename AnyPairs::value_type;
    delta.clear();
    AnyPairs entering;
    auto read = held.begin();
    auto write = held.begin();
    const auto keepOrRemove = [&](bool isKept)
    {
        if (isKept)
            *write++ = *read;
        else
            delta.removed.push_back(idsOf(*read));
        ++read;
    };
    for (const AnyPair& pair : overlapping)
    {
        while (read != held.end() && idsOf(*read) < idsOf(pair))
            keepOrRemove(mayStay(*read));
        if (read != held.end() && idsOf(*read) == idsOf(pair))
        {
            keepOrRemove(true);
        }
        else if (mayEnter(pair))
        {
            entering.push_back(pair);
            delta.added.push_back(idsOf(pair));
        }
    }
    while (read != held.end())
        keepOrRemove(mayStay(*read));

    const auto keptCount = write - held.begin();
    held.erase(write, held.end());
    held.insert(held.end(), entering.begin(), entering.end());
    std::inplace_merge(held.begin(), held.begin() + keptCount, held.end(),
                       [](const AnyPair& a, const AnyPair& b) { return idsOf(a) < idsOf(b); });
}
}  // namespace cullet
