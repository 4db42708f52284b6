// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/proxies/proxy_store.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Boxes beyond this, as those of Bullet's static planes, do not say where a world is.
constexpr btScalar kUnbounded = btScalar(1e15);
/// The origin moves if the middle one of all boxes is then so many times nearer.
constexpr btScalar kMuchNearer = btScalar(8);

btScalar medianOf(std::vector<btScalar>& values)
{
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// Largest distance of a face from a place, along any axis.
btScalar reachOf(const btBroadphaseProxy& proxy, const btVector3& place)
{
    const btVector3 low = (proxy.m_aabbMin - place).absolute(), high = (proxy.m_aabbMax - place).absolute();
    return std::max({low.x(), low.y(), low.z(), high.x(), high.y(), high.z()});
}

bool isBounded(const btBroadphaseProxy& proxy)
{
    return isValidBox(proxy.m_aabbMin, proxy.m_aabbMax) && reachOf(proxy, btVector3(0, 0, 0)) < kUnbounded;
}
}  // namespace

bool ProxyStore::recentre()
{
    std::array<std::vector<btScalar>, 3> centres;
    forEach(
        [&](const Proxy* proxy, std::uint32_t)
        {
            for (int axis = 0; axis < 3 && isBounded(*proxy); ++axis)
                centres[std::size_t(axis)].push_back((proxy->m_aabbMin[axis] + proxy->m_aabbMax[axis]) / 2);
        });
    if (centres[0].empty())
        return false;
    btVector3 place(0, 0, 0);
    for (int axis = 0; axis < 3; ++axis)
        // A whole number, so that differences to it are exact near it.
        place[axis] = std::round(medianOf(centres[std::size_t(axis)]));
    if (!isMuchNearer(place))
        return false;
    m_origin.setPlace(place);
    ++m_recentredTotal;
    forEach(
        [&](const Proxy* proxy, std::uint32_t row)
        {
            // A box that is hidden is not in the table.
            if (isValid(m_table.box(row)))
                m_table.setValidBox(row, m_origin.toTable(proxy->m_aabbMin, proxy->m_aabbMax));
        });
    return true;
}

/// Whether the middle one of all bounded boxes is much nearer to a place than to the origin.
bool ProxyStore::isMuchNearer(const btVector3& place) const
{
    std::vector<btScalar> before, after;
    forEach(
        [&](const Proxy* proxy, std::uint32_t)
        {
            if (!isBounded(*proxy))
                return;
            before.push_back(reachOf(*proxy, m_origin.place()));
            after.push_back(reachOf(*proxy, place));
        });
    return kMuchNearer * medianOf(after) <= medianOf(before);
}

Aabb ProxyStore::countedBox(const btVector3& aabbMin, const btVector3& aabbMax) noexcept
{
    const Aabb box = m_origin.toTableOrEmpty(aabbMin, aabbMax);
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
    const std::uint32_t count = std::min({size, kMostFilterRows, std::max(size / 4 + 1, kLeastFilterRows)});
    const std::uint32_t begin = m_nextFilterRow < size ? m_nextFilterRow : 0;
    const std::uint32_t end = std::min(size, begin + count);
    refreshFilters(begin, end);
    refreshFilters(0, count - (end - begin));
    m_nextFilterRow = begin + count < size ? begin + count : begin + count - size;
}

/// A proxy is read first, and nearly always nothing else has to be.
inline void ProxyStore::refreshFilters(std::uint32_t begin, std::uint32_t end) noexcept
{
    m_pool.forEach(begin, end,
                   [this](Proxy* proxy, std::uint32_t row)
                   {
                       if (!proxy->hasKnownFilter() && isValid(m_table.box(row)))
                           refreshFilter(proxy);
                   });
}

void ProxyStore::endUpdate() noexcept
{
    m_table.endUpdate();
    m_quarantinedCount = 0;
}

void ProxyStore::reset()
{
    m_table.clear();
    m_origin = TableOrigin();
    m_pool.clear();
    m_directory.clear();
    m_nextUniqueId = 1;
    m_quarantinedCount = 0;
    m_nextFilterRow = 0;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
