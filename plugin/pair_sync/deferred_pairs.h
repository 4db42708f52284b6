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
/// Pairs that the backend holds and the pair cache does not, and when to look at them again.
///
/// A pair waits because the filter refused it (or the application took it out of the cache), or because the exact boxes
/// do not overlap although the rounded ones do, or no longer do so. The second kind is looked at whenever one of its
/// boxes changes. The first kind follows btDbvtBroadphase, which asks the filter again when a leaf is put into its tree
/// anew: when a box leaves the box that it had when asked, grown by the margin, or when a filter word changes.
///
/// Costs nothing for rows that did not change.
class DeferredPairs
{
public:
    enum Reason : std::uint8_t
    {
        kRefused,
        kNotExact
    };

    /// Adds the pair, or changes its reason. The boxes are those of the two rows now.
    void insert(Pair pair, std::uint32_t rowFirst, std::uint32_t rowSecond, Reason reason, const Aabb* boxes,
                float margin);

    bool erase(Pair pair) noexcept { return m_set.erase(pair); }
    void eraseAllOf(std::uint32_t uniqueId) noexcept { m_set.eraseAllOf(uniqueId); }
    bool contains(Pair pair) const noexcept { return m_set.contains(pair); }

    /// Whether the pair was refused and neither box has left its grown box since.
    bool isFreshlyRefused(Pair pair, std::uint32_t rowFirst, std::uint32_t rowSecond,
                          const Aabb* boxes) const;

    /// Appends the pairs that the changes of the view give reason to look at again, each at least once.
    void collectDue(const ProxyView& view, Pairs& due);

    const Pairs& pairs() const noexcept { return m_set.pairs(); }
    std::size_t size() const noexcept { return m_set.size(); }
    std::uint64_t bytes() const noexcept { return m_set.bytes() + m_leaves.capacity() * sizeof(Aabb); }
    void clear();

private:
    void startLeaf(std::uint32_t uniqueId, std::uint32_t row, const Aabb* boxes, float margin);
    void collectDueOf(std::uint32_t uniqueId, bool isAskedAgain, Pairs& due) const;

    PairMap m_set;
    std::vector<Aabb> m_leaves;  // by row, for rows with pairs: the grown box
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
