// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/proxy_table.h"
#include "cullet/plugin/core/box_convert.h"
#include "cullet/plugin/core/proxy_ids.h"
#include "cullet/plugin/core/unique_id_map.h"
#include "cullet/plugin/proxies/proxy_pool.h"

#include <atomic>
#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The live proxies: Bullet's structs, their rows in the table, their unique ids.
///
/// A destroyed proxy keeps its memory and its row until the table's next endUpdate(), because the backend still holds
/// its pairs; its unique id is erased from the directory at once.
class ProxyStore
{
public:
    /// @param firstUniqueId id of the first proxy
    explicit ProxyStore(std::uint32_t firstUniqueId = 1) : m_nextUniqueId(firstUniqueId) {}

    /// Gives each proxy the next unique id; after 2^32 - 1 ids restart at 1 and skip those of live proxies. May throw
    /// std::bad_alloc and then changes nothing.
    Proxy* create(const btVector3& aabbMin, const btVector3& aabbMax, void* client, Filter filter);
    /// Makes the proxy overlap nothing and invisible to queries; the box in the proxy itself stays.
    void hide(Proxy* proxy) noexcept { m_table.setBox(rowOf(proxy), kEmptyAabb); }
    void destroy(Proxy* proxy) noexcept;

    /// Stores the box in the proxy and, relative to origin() and rounded outward to float, in the table.
    void setBox(Proxy* proxy, const btVector3& aabbMin, const btVector3& aabbMax)
    {
        proxy->m_aabbMin = aabbMin;
        proxy->m_aabbMax = aabbMax;
        if (isValidBox(aabbMin, aabbMax))
            m_table.setValidBox(rowOf(proxy), m_origin.toTable(aabbMin, aabbMax));
        else
            setInvalidBox(rowOf(proxy));
    }

    /// The origin of the boxes in the table.
    const TableOrigin& origin() const noexcept { return m_origin; }

    /// Moves origin() to where most boxes are, if they are much nearer to that place than to the present origin; all
    /// boxes in the table then change. O(bodies). May throw std::bad_alloc and then changes nothing.
    ///
    /// @return whether the origin moved
    bool recentre();

    /// Number of times that the origin moved.
    std::uint32_t recentredTotal() const noexcept { return m_recentredTotal; }

    /// Copies the filter words of the proxy, which applications write directly, to the table.
    void refreshFilter(Proxy* proxy) noexcept
    {
        if (proxy->hasKnownFilter())
            return;
        proxy->knownFilter = {proxy->m_collisionFilterGroup, proxy->m_collisionFilterMask};
        m_table.setFilter(rowOf(proxy), proxy->knownFilter);
    }

    /// Calls refreshFilter() for the next rows in turn, for proxies that receive no setAabb().
    ///
    /// At least a quarter of the rows per call and at least kLeastFilterRows, and at most kMostFilterRows.
    void refreshSomeFilters() noexcept;

    static std::uint32_t rowOf(const Proxy* proxy) noexcept { return ProxyPool::rowOf(proxy); }
    Proxy* at(std::uint32_t row) const noexcept { return m_pool.at(row); }
    /// The live proxy with the id, or null.
    Proxy* find(std::uint32_t uniqueId) const noexcept
    {
        const std::uint32_t row = m_directory.find(uniqueId);
        return row == UniqueIdMap::kNoRow ? nullptr : m_pool.at(row);
    }
    /// Prefetches what find() reads.
    [[gnu::always_inline]] void prefetchId(std::uint32_t uniqueId) const noexcept
    {
        m_directory.prefetch(uniqueId);
    }
    /// Prefetches the box in the table.
    [[gnu::always_inline]] void prefetchTableBox(std::uint32_t uniqueId) const noexcept
    {
        const std::uint32_t row = m_directory.find(uniqueId);
        if (row != UniqueIdMap::kNoRow)
            __builtin_prefetch(&m_table.box(row));
    }
    /// Whether a proxy of any broad phase is a live proxy of this store.
    bool owns(const btBroadphaseProxy* proxy) const noexcept { return find(uniqueIdOf(proxy)) == proxy; }
    bool isLive(std::uint32_t row) const noexcept { return m_directory.find(m_table.uniqueId(row)) == row; }

    /// Calls visit(proxy, row) for every live proxy, by ascending row.
    template <class Visit>
    void forEach(Visit visit) const
    {
        for (std::uint32_t row = 0; row < m_table.size(); ++row)
        {
            if (isLive(row))
                visit(m_pool.at(row), row);
        }
    }

    /// Where the search for the id of the next proxy begins: it changes with each new proxy.
    std::uint32_t upcomingUniqueId() const noexcept { return m_nextUniqueId; }
    /// Number of destroyed rows that await endUpdate().
    std::uint32_t quarantinedCount() const noexcept { return m_quarantinedCount; }
    void endUpdate() noexcept;

    /// Restarts unique ids at 1. @pre no live proxy
    void reset();

    ProxyTable& table() noexcept { return m_table; }
    const ProxyTable& table() const noexcept { return m_table; }
    std::uint64_t invalidBoxesTotal() const noexcept
    {
        return m_invalidBoxes.load(std::memory_order_relaxed);
    }
    std::uint64_t bytes() const noexcept { return m_table.bytes() + m_pool.bytes() + m_directory.bytes(); }

private:
    static constexpr std::uint32_t kLeastFilterRows = 256;
    static constexpr std::uint32_t kMostFilterRows = 4096;

    void refreshFilters(std::uint32_t begin, std::uint32_t end) noexcept;
    std::uint32_t nextUniqueId() noexcept;
    bool isMuchNearer(const btVector3& place) const;
    Aabb countedBox(const btVector3& aabbMin, const btVector3& aabbMax) noexcept;
    void setInvalidBox(std::uint32_t row) noexcept;

    ProxyTable m_table;
    ProxyPool m_pool;
    UniqueIdMap m_directory;
    TableOrigin m_origin;
    std::uint32_t m_recentredTotal = 0;
    std::uint32_t m_nextUniqueId;
    std::uint32_t m_quarantinedCount = 0;
    std::uint32_t m_nextFilterRow = 0;
    std::atomic<std::uint64_t> m_invalidBoxes{0};
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
