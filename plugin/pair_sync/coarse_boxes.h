// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/proxies/proxy_store.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Boxes in double that are so far from the table's origin that their floats are coarse (isCoarse()). They cost time only:
/// their rounded boxes may overlap long after the exact ones have separated.
class CoarseBoxes
{
public:
    explicit CoarseBoxes(ProxyStore& store) : m_store(store) {}

    /// Whether the box of any changed row is coarse; never in single precision.
    static bool haveChanged(const ProxyView& view);

    /// Moves the origin of the table's boxes, if floats are too coarse where most of them are. To be called in an update with
    /// coarse changes. A world that nothing makes finer is seldom examined.
    ///
    /// @param update its number
    /// @return whether the origin moved, and all boxes of the table with it
    bool tryRecentre(std::uint64_t update);

    /// Appends the pairs of the cache that have a coarse box, and whose exact boxes are separated by the margin. To be called
    /// if a coarse box has changed, or may have changed in an update that an exception ended. O(pairs).
    void collectSeparated(btOverlappingPairCache& cache, float margin, Pairs& separated) const;

private:
    // Updates until the origin may move again.
    static constexpr std::uint64_t kShortestWait = 16, kLongestWait = 1024;

    ProxyStore& m_store;
    std::uint64_t m_wait = kShortestWait;
    std::uint64_t m_nextUpdate = 0;  ///< the first one in which the origin may move
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
