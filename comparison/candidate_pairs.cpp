// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/candidate_pairs.h"

#include "cullet/broad/pairs/restart_rows.h"

#include <algorithm>

namespace cullet
{
void CandidatePairs::restart(const Pairs& known)
{
    m_known = known;
    m_held.clear();
}

void CandidatePairs::begin(const ProxyView& proxies)
{
    m_testCount = 0;
    m_overlapping.clear();
    if (m_known.empty())
        return;
    m_held = findRowsOf(m_known, proxies);
    m_known = {};
}

void CandidatePairs::addOverlap(const ProxyView& proxies, std::uint32_t a, std::uint32_t b)
{
    const std::uint32_t* ids = proxies.uniqueIds;
    if (ids[a] > ids[b])
        std::swap(a, b);
    m_overlapping.push_back({{ids[a], ids[b]}, a, b});
}

void CandidatePairs::finish(const ProxyView& proxies, PairDelta& delta)
{
    std::sort(m_overlapping.begin(), m_overlapping.end(),
              [](const KeyedPair& a, const KeyedPair& b) { return a.ids < b.ids; });
    const auto isSame = [](const KeyedPair& a, const KeyedPair& b) { return a.ids == b.ids; };
    m_overlapping.erase(std::unique(m_overlapping.begin(), m_overlapping.end(), isSame), m_overlapping.end());
    const auto mayEnter = [&](const KeyedPair& pair)
    {
        return proxies.filters == nullptr ||
               passesFilter(proxies.filters[pair.firstRow], proxies.filters[pair.secondRow]);
    };
    const auto mayStay = [&](const KeyedPair& pair)
    {
        if (pair.firstRow == kNoRow || pair.secondRow == kNoRow)
            return false;
        const Aabb& first = proxies.boxes[pair.firstRow];
        const Aabb& second = proxies.boxes[pair.secondRow];
        return isValid(first) && isValid(second) && overlapsWithMargin(first, second, proxies.margin);
    };
    updateHeldPairs(m_held, m_overlapping, mayEnter, mayStay, delta);
}
}  // namespace cullet
