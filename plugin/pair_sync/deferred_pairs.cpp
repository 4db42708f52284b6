// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/deferred_pairs.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
Aabb grown(Aabb box, float margin) noexcept
{
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] -= margin;
        box.max[axis] += margin;
    }
    return box;
}

bool encloses(const Aabb& outer, const Aabb& inner) noexcept
{
    for (int axis = 0; axis < 3; ++axis)
    {
        if (!(outer.min[axis] <= inner.min[axis] && inner.max[axis] <= outer.max[axis]))
            return false;
    }
    return true;
}
}  // namespace

void DeferredPairs::storeGrownBox(std::uint32_t uniqueId, std::uint32_t row, const Aabb* boxes, float margin)
{
    // A row with deferred pairs keeps its grown box, to which their filter results belong.
    if (m_set.hasPairsOf(uniqueId))
        return;
    if (m_grownBoxes.size() <= row)
        m_grownBoxes.resize(row + 1 + row / 2, kEmptyAabb);
    m_grownBoxes[row] = grown(boxes[row], margin);
}

void DeferredPairs::insert(Pair pair, std::uint32_t rowFirst, std::uint32_t rowSecond, Reason reason,
                           const Aabb* boxes, float margin)
{
    storeGrownBox(pair.first, rowFirst, boxes, margin);
    storeGrownBox(pair.second, rowSecond, boxes, margin);
    m_set.insert(pair, reason);
}

bool DeferredPairs::isRefusalCurrent(Pair pair, std::uint32_t rowFirst, std::uint32_t rowSecond,
                                     const Aabb* boxes) const
{
    const std::uint32_t index = m_set.find(pair);
    return index != PairMap::kNone && m_set.tag(index) == kRefused &&
           encloses(m_grownBoxes[rowFirst], boxes[rowFirst]) &&
           encloses(m_grownBoxes[rowSecond], boxes[rowSecond]);
}

void DeferredPairs::collectToReevaluateOf(std::uint32_t uniqueId, bool includesRefused,
                                          Pairs& toReevaluate) const
{
    m_set.forEachOf(uniqueId,
                    [&](std::uint32_t index)
                    {
                        if (includesRefused || m_set.tag(index) == kSeparated)
                            toReevaluate.push_back(m_set.pairs()[index]);
                    });
}

void DeferredPairs::collectToReevaluate(const ProxyView& view, Pairs& toReevaluate)
{
    if (m_set.size() == 0)
        return;
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        const std::uint32_t uniqueId = view.uniqueIds[row];
        if ((view.changes[row] & kRowDestroyed) != 0 || !m_set.hasPairsOf(uniqueId))
            continue;
        const bool hasLeft = !encloses(m_grownBoxes[row], view.boxes[row]);
        if (hasLeft)
            m_grownBoxes[row] = grown(view.boxes[row], view.margin);
        collectToReevaluateOf(uniqueId, hasLeft || (view.changes[row] & kRowRefiltered) != 0, toReevaluate);
    }
}

void DeferredPairs::clear()
{
    m_set.clear();
    std::vector<Aabb>().swap(m_grownBoxes);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
