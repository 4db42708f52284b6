// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/pair.h"
#include "cullet/plugin/pair_sync/pair_map.h"

#include <cstdint>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Pairs that the backend holds and the pair cache lacks, and the conditions for re-evaluating them.
///
/// A pair is deferred because the filter refused it (or the application removed it from the cache), or because the
/// exact boxes are separated although the rounded ones overlap or are within the margin. A pair of the second kind is
/// re-evaluated whenever one of its boxes changes. The first kind follows btDbvtBroadphase, which calls the filter
/// again when it reinserts a leaf into its tree: when a box leaves the box that it had at the last evaluation, grown
/// by the margin, or when a filter word changes.
///
/// Unchanged rows cost nothing.
class DeferredPairs
{
public:
    enum Reason : std::uint8_t
    {
        kRefused,
        kSeparated
    };

    /// Adds the pair, or changes its reason. `boxes` are the current boxes by row.
    void insert(Pair pair, std::uint32_t rowFirst, std::uint32_t rowSecond, Reason reason, const Aabb* boxes,
                float margin);

    bool erase(Pair pair) noexcept { return m_set.erase(pair); }
    void eraseAllOf(std::uint32_t uniqueId) noexcept { m_set.eraseAllOf(uniqueId); }
    bool contains(Pair pair) const noexcept { return m_set.contains(pair); }

    /// Whether the filter refused the pair and neither box has left its grown box since.
    bool isRefusalCurrent(Pair pair, std::uint32_t rowFirst, std::uint32_t rowSecond,
                          const Aabb* boxes) const;

    /// Appends the pairs to re-evaluate after the changes of the view, each at least once.
    void collectToReevaluate(const ProxyView& view, Pairs& toReevaluate);

    const Pairs& pairs() const noexcept { return m_set.pairs(); }
    std::size_t size() const noexcept { return m_set.size(); }
    std::uint64_t bytes() const noexcept { return m_set.bytes() + m_grownBoxes.capacity() * sizeof(Aabb); }
    void clear();

private:
    void storeGrownBox(std::uint32_t uniqueId, std::uint32_t row, const Aabb* boxes, float margin);
    void collectToReevaluateOf(std::uint32_t uniqueId, bool includesRefused, Pairs& toReevaluate) const;

    PairMap m_set;
    std::vector<Aabb> m_grownBoxes;  // by row, for rows with pairs: the grown box
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
