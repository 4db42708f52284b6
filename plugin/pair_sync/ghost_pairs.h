// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/queries/query_index.h"
#include "cullet/plugin/pair_sync/ghost_boxes.h"
#include "cullet/plugin/pair_sync/ghost_neighbours.h"
#include "cullet/plugin/pair_sync/pair_sync.h"
#include "cullet/plugin/proxies/proxy_store.h"

#include <atomic>
#include <cstdint>
#include <mutex>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Adds the pairs of ghost objects immediately, as Bullet's character controller requires: it moves its ghost and reads
/// the ghost's pairs in the next statement.
///
/// Ghosts exist only while a ghost pair callback is installed in the pair cache; without one the client object of a
/// proxy may be anything and is not accessed. When a callback is installed, all existing ghost objects become ghosts.
///
/// A ghost that moves is searched for in the index, once it leaves what its last search covered: GhostNeighbours lists
/// what is near a ghost that walks. The tree of ghosts then has the ghost's reach instead of its box, so that whatever
/// comes near is added to the list.
class GhostPairs
{
public:
    /// Observes the removals of `pairSync`, which must not update any more once this object is gone.
    GhostPairs(ProxyStore& store, PairSync& pairSync);
    GhostPairs(const GhostPairs&) = delete;
    GhostPairs& operator=(const GhostPairs&) = delete;

    /// Detects whether a ghost callback was installed or removed. O(1); O(bodies) after such a change.
    ///
    /// May run concurrently, from setAabb().
    void pollCallback()
    {
        if (m_pairSync.adapter().hasGhostCallback() != m_hasGhostCallback.load(std::memory_order_acquire))
            rescan();
    }

    /// Whether pollCallback() or addPairs() would do anything. May run concurrently.
    bool hasWork() const
    {
        return m_pairSync.adapter().hasGhostCallback() !=
                   m_hasGhostCallback.load(std::memory_order_acquire) ||
               !m_ghostBoxes.isEmpty();
    }

    /// Call add() for a new proxy, before its first setBox(), and remove() before a proxy is destroyed.
    void add(const Proxy& proxy);
    void remove(const Proxy& proxy);

    /// Adds the pairs of a proxy's new box with ghosts. The index must contain the box.
    void addPairs(Proxy& proxy, const QueryIndex& index)
    {
        if (m_ghostBoxes.isEmpty())
            return;
        followOrigin();
        addPairsOfBox(proxy, index);
    }

    /// Shrinks the bounds of moving ghosts, which have only grown since the last call. Call once per update.
    void tighten() noexcept
    {
        followOrigin();
        m_ghostBoxes.tighten();
    }

    std::uint32_t count() const noexcept { return m_ghostBoxes.size(); }
    std::uint64_t bytes() const noexcept { return m_ghostBoxes.bytes() + m_neighbours.bytes(); }

private:
    void rescan();
    void followOrigin() noexcept
    {
        if (m_recentredTotal != m_store.recentredTotal())
            readBoxesAgain();
    }
    void readBoxesAgain() noexcept;
    void addPairsOfBox(Proxy& proxy, const QueryIndex& index);
    void recordPaired(Proxy& proxy, const std::vector<std::uint32_t>& ids);
    void forgetPaired(const Pairs& pairs) noexcept;
    void followCache() noexcept;
    bool listNeighbours(std::uint32_t row, const Aabb& box, const QueryIndex& index);
    template <class Visit>
    void visitNearGhost(const Proxy& ghost, const Aabb& box, const QueryIndex& index, Visit& visit);
    template <class Visit>
    void visitGhostsNear(std::uint32_t row, const Aabb& box, Visit visit);

    ProxyStore& m_store;
    PairSync& m_pairSync;
    GhostBoxes m_ghostBoxes;  ///< of a ghost in m_neighbours: its reach
    GhostNeighbours m_neighbours;
    std::atomic<bool> m_hasGhostCallback{false};
    std::mutex m_rescan;
    std::vector<std::uint32_t> m_overlappingIds;
    std::uint64_t m_externalChanges = 0;  ///< of the cache, at the last followCache()
    std::uint32_t m_recentredTotal = 0;   ///< of the store, at the last readBoxesAgain()
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
