// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"

#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace cullet::test
{
/// The definition of the pair set in Backend's docstring as a model: a set of id pairs and a map of boxes.
///
/// Shares no code and no arithmetic with the library (gaps in double precision instead of float comparisons), so that
/// the two cannot share a fault in overlaps(), overlapsWithMargin(), isValid() or the pair lists. It ignores `dirty`
/// and `changes`: conclusions of a backend from them must also follow from the boxes. O(n^2) per update.
class PairOracle
{
public:
    using RowPair = std::pair<std::uint32_t, std::uint32_t>;

    /// Moves to the view's boxes and returns what changed.
    PairDelta update(const ProxyView& proxies);

    void restart(const Pairs& known);

    Pairs pairs() const;
    std::size_t pairCount() const { return m_pairs.size(); }

private:
    struct Body
    {
        Aabb box;
        Filter filter;
    };

    void readBodies(const ProxyView& proxies);
    bool stays(RowPair pair, float margin) const;

    std::map<std::uint32_t, Body> m_bodies;  ///< bodies with a box that can overlap, by id
    std::set<RowPair> m_pairs;
};
}  // namespace cullet::test
