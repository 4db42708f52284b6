// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/proxies/proxy_store.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
Aabb ProxyStore::countedBox(const btVector3& aabbMin, const btVector3& aabbMax) noexcept
{
    const Aabb box = toTableBox(aabbMin, aabbMax);
    if (!isValid(box))
        m_invalidBoxes.fetch_add(1, std::memory_order_relaxed);
    return box;
}

Proxy* ProxyStore::create(const btVector3& aabbMin, const btVector3& aabbMax, void* client, Filter filter)
{
    const std::uint32_t uniqueId = nextUniqueId();
    // All allocations precede the insertion into the table, which cannot be undone.
    const std::uint32_t row = m_table.reserveRow();
    Proxy* proxy = m_pool.make(row);
    m_directory.insert(uniqueId, row);
    m_table.create(countedBox(aabbMin, aabbMax), uniqueId, filter);
    m_nextUniqueId = uniqueId + 1;
    static_cast<btBroadphaseProxy&>(*proxy) =
        btBroadphaseProxy(aabbMin, aabbMax, client, filter.group, filter.mask);
    proxy->knownFilter = filter;
    proxy->m_uniqueId = static_cast<int>(uniqueId);
    return proxy;
}

std::uint32_t ProxyStore::nextUniqueId() noexcept
{
    // Id 0 marks free rows.
    while (m_nextUniqueId == 0 || m_directory.find(m_nextUniqueId) != UniqueIdMap::kNoRow)
        ++m_nextUniqueId;
    return m_nextUniqueId;
}

void ProxyStore::destroy(Proxy* proxy) noexcept
{
    const std::uint32_t row = rowOf(proxy);
    m_directory.erase(uniqueIdOf(proxy));
    m_table.destroy(row);
    proxy->m_clientObject = nullptr;
    ++m_quarantinedCount;
}

void ProxyStore::setInvalidBox(std::uint32_t row) noexcept
{
    m_invalidBoxes.fetch_add(1, std::memory_order_relaxed);
    m_table.setBox(row, kEmptyAabb);
}

void ProxyStore::refreshSomeFilters() noexcept
{
    const std::uint32_t size = m_table.size();
    const std::uint32_t count = std::min({size, kMostFilterRows, std::max(size / 4, kLeastFilterRows)});
    for (std::uint32_t i = 0; i < count; ++i)
    {
        if (m_nextFilterRow >= size)
            m_nextFilterRow = 0;
        // The proxy is read first, and nearly always nothing else has to be.
        Proxy* const proxy = m_pool.at(m_nextFilterRow);
        if (!proxy->hasKnownFilter() && isValid(m_table.box(m_nextFilterRow)))
            refreshFilter(proxy);
        ++m_nextFilterRow;
    }
}

void ProxyStore::endUpdate() noexcept
{
    m_table.endUpdate();
    m_quarantinedCount = 0;
}

void ProxyStore::reset()
{
    m_table.clear();
    m_pool.clear();
    m_directory.clear();
    m_nextUniqueId = 1;
    m_quarantinedCount = 0;
    m_nextFilterRow = 0;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
