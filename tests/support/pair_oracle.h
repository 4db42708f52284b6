// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace cullet::test
{
/// The definition of the pair set in Backend's docstring as a model: a set of id pairs and a list of boxes.
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
        std::uint32_t id;
        std::array<double, 3> min, max;
        Filter filter;
    };

    static double gapBetween(const Body& a, const Body& b);
    static bool areApart(const Body& a, const Body& b);

    void readBodies(const ProxyView& proxies);
    const Body* find(std::uint32_t id) const;
    bool stays(RowPair pair, float margin) const;
    std::vector<RowPair> overlaps() const;  ///< sorted

    std::vector<Body> m_bodies;    ///< bodies with a box that can overlap, in the order of their ids
    std::vector<RowPair> m_pairs;  ///< sorted
};
}  // namespace cullet::test
