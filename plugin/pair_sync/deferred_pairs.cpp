// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/deferred_pairs.h"

#include "cullet/plugin/pair_sync/grown_box.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
void DeferredPairs::storeGrownBox(std::uint32_t uniqueId, std::uint32_t row, const Aabb* boxes, float margin)
{
    if (m_grownBoxes.size() <= row)
    {
        // The vector that is compared grows last: either may throw.
        m_marks.resize(row + 1 + row / 2, Mark::None);
        m_grownBoxes.resize(m_marks.size(), kEmptyAabb);
    }
    // A row with deferred pairs keeps its grown box, to which their filter results belong.
    if (m_marks[row] == Mark::None && !m_set.hasPairsOf(uniqueId))
        m_grownBoxes[row] = grown(boxes[row], margin);
}

void DeferredPairs::insert(Pair pair, std::uint32_t rowFirst, std::uint32_t rowSecond, Reason reason,
                           const Aabb* boxes, float margin)
{
    if (reason == kRefused && hasMarkedRows())
        return mark(pair, rowFirst, rowSecond, boxes, margin);
    storeGrownBox(pair.first, rowFirst, boxes, margin);
    storeGrownBox(pair.second, rowSecond, boxes, margin);
    m_set.insert(pair, reason);
}

void DeferredPairs::mark(Pair pair, std::uint32_t rowFirst, std::uint32_t rowSecond, const Aabb* boxes,
                         float margin)
{
    storeGrownBox(pair.first, rowFirst, boxes, margin);
    storeGrownBox(pair.second, rowSecond, boxes, margin);
    erase(pair);
    mark(rowFirst);
    mark(rowSecond);
}

bool DeferredPairs::isNear(Pair pair) const noexcept
{
    const std::uint32_t index = m_set.size() == 0 ? PairMap::kNone : m_set.find(pair);
    return index != PairMap::kNone && m_set.tag(index) == kNear;
}

void DeferredPairs::confirmHeld(Pair pair) noexcept
{
    const std::uint32_t index = m_set.size() == 0 ? PairMap::kNone : m_set.find(pair);
    if (index != PairMap::kNone && m_set.tag(index) == kNear)
        m_set.setTag(index, kSeparated);
}

bool DeferredPairs::isRefusalCurrent(Pair pair, std::uint32_t rowFirst, std::uint32_t rowSecond,
                                     const Aabb* boxes) const
{
    const std::uint32_t index = m_set.size() == 0 ? PairMap::kNone : m_set.find(pair);
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
                        if (includesRefused || m_set.tag(index) != kRefused)
                            toReevaluate.push_back(m_set.pairs()[index]);
                    });
}

void DeferredPairs::collectToReevaluate(const ProxyView& view, Pairs& toReevaluate,
                                        std::vector<std::uint32_t>& due)
{
    if (!mayHavePairs())
        return;
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        const std::uint32_t uniqueId = view.uniqueIds[row];
        const bool isMarked = row < m_marks.size() && m_marks[row] != Mark::None;
        if ((view.changes[row] & kRowDestroyed) != 0 || !(isMarked || m_set.hasPairsOf(uniqueId)))
            continue;
        const bool hasLeft = !encloses(m_grownBoxes[row], view.boxes[row]);
        if (hasLeft)
            m_grownBoxes[row] = grown(view.boxes[row], view.margin);
        const bool isDueNow = hasLeft || (view.changes[row] & kRowRefiltered) != 0;
        collectToReevaluateOf(uniqueId, isDueNow, toReevaluate);
        if (!isMarked || !isDueNow)
            continue;
        due.push_back(uniqueId);
        m_marks[row] = Mark::Due;
    }
}

void DeferredPairs::eraseAllOf(std::uint32_t uniqueId, std::uint32_t row) noexcept
{
    m_set.eraseAllOf(uniqueId);
    if (row < m_marks.size())
        setMark(row, Mark::None);
}

void DeferredPairs::setMark(std::uint32_t row, Mark mark) noexcept
{
    m_markedRows += mark != Mark::None ? 1u : 0u;
    m_markedRows -= m_marks[row] != Mark::None ? 1u : 0u;
    m_marks[row] = mark;
}

void DeferredPairs::followRestart() noexcept
{
    for (std::uint32_t index = 0; index < m_set.size(); ++index)
    {
        if (m_set.tag(index) == kNear)
            m_set.setTag(index, kSeparated);
    }
    std::fill(m_marks.begin(), m_marks.end(), Mark::None);
    m_markedRows = 0;
    if (m_set.size() != 0)
        return;
    // Where AllowedPairs takes over there may be none for long.
    m_marks = {};
    m_grownBoxes = {};
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
