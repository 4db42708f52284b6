// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/support/pair_oracle.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <utility>

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

bool wantEachOther(Filter a, Filter b)
{
    const bool firstWants = (b.group & a.mask) != 0;
    const bool secondWants = (a.group & b.mask) != 0;
    return firstWants && secondWants;
}
}  // namespace

/// Width of the gap between two boxes along the axis where it is widest; negative when they overlap on all.
///
/// Two boxes that reach the same infinity have no gap there.
double PairOracle::gapBetween(const Body& a, const Body& b)
{
    double widest = -HUGE_VAL;
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
        for (const double gap : {b.min[axis] - a.max[axis], a.min[axis] - b.max[axis]})
        {
            if (!std::isnan(gap) && gap > widest)
                widest = gap;
        }
    }
    return widest;
}

/// Whether gapBetween() is positive. Without branches, which would be hard to predict.
bool PairOracle::areApart(const Body& a, const Body& b)
{
    // A NaN is not positive.
    bool hasGap = false;
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
        hasGap |= b.min[axis] - a.max[axis] > 0.0;
        hasGap |= a.min[axis] - b.max[axis] > 0.0;
    }
    return hasGap;
}

void PairOracle::readBodies(const ProxyView& proxies)
{
    m_bodies.clear();
    for (std::uint32_t row = 0; row < proxies.size; ++row)
    {
        const Aabb& box = proxies.boxes[row];
        if (!isSolid(box))
            continue;
        // Without filter words all pairs are allowed.
        const Filter filter = proxies.filters != nullptr ? proxies.filters[row] : Filter{-1, -1};
        m_bodies.push_back({proxies.uniqueIds[row],
                            {box.min[0], box.min[1], box.min[2]},
                            {box.max[0], box.max[1], box.max[2]},
                            filter});
    }
    std::sort(m_bodies.begin(), m_bodies.end(), [](const Body& a, const Body& b) { return a.id < b.id; });
}

const PairOracle::Body* PairOracle::find(std::uint32_t id) const
{
    const auto found =
        std::lower_bound(m_bodies.begin(), m_bodies.end(), id,
                         [](const Body& body, std::uint32_t wanted) { return body.id < wanted; });
    return found != m_bodies.end() && found->id == id ? &*found : nullptr;
}

bool PairOracle::stays(RowPair pair, float margin) const
{
    const Body *const first = find(pair.first), *const second = find(pair.second);
    if (first == nullptr || second == nullptr)
        return false;
    // The definition rounds the gap to float once; rounding the exact double difference gives the same float.
    const float gap = static_cast<float>(gapBetween(*first, *second));
    return gap <= margin + margin;
}

std::vector<PairOracle::RowPair> PairOracle::overlaps() const
{
    std::vector<RowPair> found;
    for (auto a = m_bodies.begin(); a != m_bodies.end(); ++a)
    {
        for (auto b = std::next(a); b != m_bodies.end(); ++b)
        {
            if (!areApart(*a, *b) && wantEachOther(a->filter, b->filter))
                found.push_back({a->id, b->id});
        }
    }
    return found;
}

PairDelta PairOracle::update(const ProxyView& proxies)
{
    readBodies(proxies);
    PairDelta delta;
    std::vector<RowPair> kept, all;
    for (const RowPair& pair : m_pairs)
    {
        if (stays(pair, proxies.margin))
            kept.push_back(pair);
        else
            delta.removed.push_back({pair.first, pair.second});
    }
    const std::vector<RowPair> found = overlaps();
    std::set_union(kept.begin(), kept.end(), found.begin(), found.end(), std::back_inserter(all));
    std::vector<RowPair> added;
    std::set_difference(found.begin(), found.end(), kept.begin(), kept.end(), std::back_inserter(added));
    for (const RowPair& pair : added)
        delta.added.push_back({pair.first, pair.second});
    m_pairs = std::move(all);
    return delta;
}

void PairOracle::restart(const Pairs& known)
{
    m_pairs.clear();
    for (const Pair pair : known)
        m_pairs.push_back({pair.first, pair.second});
    std::sort(m_pairs.begin(), m_pairs.end());
    m_pairs.erase(std::unique(m_pairs.begin(), m_pairs.end()), m_pairs.end());
}

Pairs PairOracle::pairs() const
{
    Pairs list;
    for (const RowPair& pair : m_pairs)
        list.push_back({pair.first, pair.second});
    return list;
}
}  // namespace cullet::test
