// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/resting/verlet_update.h"

#include "cullet/broad/pairs/pair_table.h"

#include <algorithm>
#include <array>
#include <utility>

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
            const bool wasHeld = core.heldBefore.erase(PairSet::keyOf(pair.a, pair.b));
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

void updatePairState(GridCore& core, const ProxyView& view, VerletPairs& pairs, std::size_t index,
                     unsigned worker)
{
    const VerletPairs::State state = pairs.state(index);
    const RowPair pair = pairs.pair(index);
    const Aabb& a = view.boxes[pair.a];
    const Aabb& b = view.boxes[pair.b];
    const bool overlap = overlapsBranchless(a, b);
    // A candidate may be a former pair that the filter words reject by now, hence mayEnter().
    if (state == VerletPairs::State::Candidate && overlap && mayEnter(view, pair))
    {
        const bool stays = pairs.isPersistent(core.reference[pair.a], core.reference[pair.b]);
        pairs.setState(index, stays ? VerletPairs::State::Persistent : VerletPairs::State::Overlapping);
        core.delta.add(view, pair, worker);
    }
    else if (state == VerletPairs::State::Overlapping && !overlap && !overlapsWithMargin(a, b, view.margin))
    {
        pairs.setState(index, VerletPairs::State::Candidate);
        core.delta.remove(view, pair, worker);
    }
}

void updateChangeablePairs(GridCore& core, const ProxyView& view, VerletPairs& pairs, unsigned worker)
{
    constexpr std::uint32_t kBlock = 512;  // pairs per call of the kernel
    const PairStateSource source = pairs.pairStateSource(view.boxes, view.margin);
    std::array<std::uint32_t, kBlock> changed;
    const auto first = static_cast<std::uint32_t>(pairs.firstChangeable());
    const auto size = static_cast<std::uint32_t>(pairs.size());
    for (std::uint32_t begin = first; begin < size; begin += kBlock)
    {
        const std::uint32_t end = std::min(begin + kBlock, size);
        const std::uint32_t count = core.kernels.findChangedPairs(source, begin, end, changed.data());
        for (std::uint32_t i = 0; i < count; ++i)
            updatePairState(core, view, pairs, changed[i], worker);
    }
}
}  // namespace cullet
