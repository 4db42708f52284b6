// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/pairs/pair_diff.h"

#include <algorithm>
#include <iterator>

namespace cullet
{
void diffSortedPairs(const Pairs& before, const Pairs& after, PairDelta& delta)
{
    delta.clear();
    std::set_difference(after.begin(), after.end(), before.begin(), before.end(),
                        std::back_inserter(delta.added));
    std::set_difference(before.begin(), before.end(), after.begin(), after.end(),
                        std::back_inserter(delta.removed));
}

void applyDelta(Pairs& pairs, const PairDelta& delta)
{
    if (!delta.removed.empty())
    {
        // Both lists are sorted, so one cursor into `removed` is enough.
        auto next = delta.removed.begin();
        auto write = pairs.begin();
        for (const Pair pair : pairs)
        {
            if (next != delta.removed.end() && pair == *next)
                ++next;
            else
                *write++ = pair;
        }
        pairs.erase(write, pairs.end());
    }
    const auto middle = static_cast<std::ptrdiff_t>(pairs.size());
    pairs.insert(pairs.end(), delta.added.begin(), delta.added.end());
    std::inplace_merge(pairs.begin(), pairs.begin() + middle, pairs.end());
}
}  // namespace cullet
