// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/resting/classify_pairs.h"

#include "cullet/broad/pairs/pair_tests.h"

#include <utility>
#include <vector>

namespace cullet
{
void classifyPairs(GridCore& core, const ProxyView& view, const CollectingSink& candidates,
                   const std::vector<RowPair>& held, VerletPairs& pairs)
{
    core.sortHeldBefore(held);
    std::vector<std::pair<RowPair, VerletPairs::State>> changeable;
    candidates.forEach(
        [&](RowPair pair)
        {
            const bool wasHeld = core.heldBefore.erase(rowKey(pair));
            const bool passes = mayEnter(view, pair);
            if (!passes && !wasHeld)
                return;
            const Aabb& a = view.boxes[pair.a];
            const Aabb& b = view.boxes[pair.b];
            const bool isHeld = overlaps(a, b) || (wasHeld && overlapsWithMargin(a, b, view.margin));
            if (isHeld && pairs.isPersistent(a, b))
                pairs.add(pair, VerletPairs::State::Persistent);
            else
                changeable.push_back(
                    {pair, isHeld ? VerletPairs::State::Overlapping : VerletPairs::State::Candidate});
            if (isHeld && !wasHeld)
                core.delta.add(view, pair);
            if (!isHeld && wasHeld)
                core.delta.remove(view, pair);
        });
    core.heldBefore.forEach(
        [&](std::uint64_t key)
        {
            const RowPair pair = rowsOf(key);
            const bool valid = isValid(view.boxes[pair.a]) && isValid(view.boxes[pair.b]);
            if (valid && overlapsWithMargin(view.boxes[pair.a], view.boxes[pair.b], view.margin))
                changeable.push_back({pair, VerletPairs::State::Overlapping});
            else
                core.delta.remove(view, pair);
        });
    for (const auto& [pair, state] : changeable)
        pairs.add(pair, state);
}
}  // namespace cullet
