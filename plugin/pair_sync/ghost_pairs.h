// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/queries/query_index.h"
#include "cullet/plugin/pair_sync/ghost_boxes.h"
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
/// Adds the pairs of ghost objects at once, as Bullet's character controller needs: it moves its ghost and reads the
/// ghost's pairs in the next statement.
///
/// Ghosts exist only while a ghost pair callback is installed in the pair cache; without one the client object of a
/// proxy may be anything and is not looked at. Installing a callback makes ghosts of all ghost objects that are there.
class GhostPairs
{
public:
    GhostPairs(ProxyStore& store, PairSync& pairSync) : m_store(store), m_pairSync(pairSync) {}

    /// Notices whether a ghost callback came or went. O(1), O(bodies) when one did.
    ///
    /// May run concurrently, from setAabb().
    void look()
    {
        if (m_pairSync.adapter().hasGhostCallback() != m_isWatching.load(std::memory_order_acquire))
            rescan();
    }

    /// To be called for a new proxy, before setBox(), and before one is destroyed.
    void add(const Proxy& proxy);
    void remove(const Proxy& proxy);

    /// Adds the pairs with ghosts that the new box of a proxy makes. The index must see the box.
    void addPairs(Proxy& proxy, const QueryIndex& index)
    {
        if (!m_ghostBoxes.isEmpty())
            addPairsNear(proxy, index);
    }

    /// Forgets what bounds of moving ghosts have grown to. To be called once per update.
    void tighten() noexcept { m_ghostBoxes.tighten(); }

    std::uint32_t count() const noexcept { return m_ghostBoxes.size(); }
    std::uint64_t bytes() const noexcept { return m_ghostBoxes.bytes(); }

private:
    void rescan();
    void addPairsNear(Proxy& proxy, const QueryIndex& index);

    ProxyStore& m_store;
    PairSync& m_pairSync;
    GhostBoxes m_ghostBoxes;
    std::atomic<bool> m_isWatching{false};
    std::mutex m_rescan;
    std::vector<std::uint32_t> m_touched;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
