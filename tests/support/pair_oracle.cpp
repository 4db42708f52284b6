// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/support/pair_oracle.h"

#include <cmath>

namespace cullet::test
{
namespace
{
bool isSolid(const Aabb& box)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        if (std::isnan(box.min[axis]) || std::isnan(box.max[axis]))
            return false;
        if (box.max[axis] < box.min[axis])
            return false;
    }
    return true;
}

/// Width of the gap between two boxes along the axis where it is widest; negative when they overlap on all.
///
/// Two boxes that reach the same infinity have no gap there.
double gapBetween(const Aabb& a, const Aabb& b)
{
    double widest = -HUGE_VAL;
    for (int axis = 0; axis < 3; ++axis)
    {
        const double above = static_cast<double>(b.min[axis]) - static_cast<double>(a.max[axis]);
        const double below = static_cast<double>(a.min[axis]) - static_cast<double>(b.max[axis]);
        for (const double gap : {above, below})
        {
            if (!std::isnan(gap) && gap > widest)
                widest = gap;
        }
    }
    return widest;
}

bool wantEachOther(Filter a, Filter b)
{
    const bool firstWants = (b.group & a.mask) != 0;
    const bool secondWants = (a.group & b.mask) != 0;
    return firstWants && secondWants;
}
}  // namespace

void PairOracle::readBodies(const ProxyView& proxies)
{
    m_bodies.clear();
    for (std::uint32_t row = 0; row < proxies.size; ++row)
    {
        // Without filter words all pairs are allowed.
        const Filter filter = proxies.filters != nullptr ? proxies.filters[row] : Filter{-1, -1};
        if (isSolid(proxies.boxes[row]))
            m_bodies[proxies.uniqueIds[row]] = {proxies.boxes[row], filter};
    }
}

bool PairOracle::stays(RowPair pair, float margin) const
{
    const auto first = m_bodies.find(pair.first);
    const auto second = m_bodies.find(pair.second);
    if (first == m_bodies.end() || second == m_bodies.end())
        return false;
    // The definition rounds the gap to float once; rounding the exact double difference gives the same float.
    const float gap = static_cast<float>(gapBetween(first->second.box, second->second.box));
    return gap <= margin + margin;
}

PairDelta PairOracle::update(const ProxyView& proxies)
{
    readBodies(proxies);
    PairDelta delta;
    for (auto pair = m_pairs.begin(); pair != m_pairs.end();)
    {
        if (stays(*pair, proxies.margin))
        {
            ++pair;
            continue;
        }
        delta.removed.push_back({pair->first, pair->second});
        pair = m_pairs.erase(pair);
    }
    for (auto a = m_bodies.begin(); a != m_bodies.end(); ++a)
    {
        for (auto b = std::next(a); b != m_bodies.end(); ++b)
        {
            if (gapBetween(a->second.box, b->second.box) > 0)
                continue;
            if (!wantEachOther(a->second.filter, b->second.filter))
                continue;
            if (m_pairs.insert({a->first, b->first}).second)
                delta.added.push_back({a->first, b->first});
        }
    }
    return delta;
}

void PairOracle::restart(const Pairs& known)
{
    m_pairs.clear();
    for (const Pair pair : known)
        m_pairs.insert({pair.first, pair.second});
}

Pairs PairOracle::pairs() const
{
    Pairs list;
    for (const RowPair& pair : m_pairs)
        list.push_back({pair.first, pair.second});
    return list;
}
}  // namespace cullet::test
