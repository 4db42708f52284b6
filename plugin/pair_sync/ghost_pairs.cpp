// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/ghost_pairs.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <algorithm>
#include <utility>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
bool isGhost(const Proxy& proxy)
{
    const auto* object = static_cast<const btCollisionObject*>(proxy.m_clientObject);
    return object != nullptr && object->getInternalType() == btCollisionObject::CO_GHOST_OBJECT;
}
}  // namespace

void GhostPairs::rescan()
{
    const std::lock_guard<std::mutex> lock(m_rescan);
    const bool isInstalled = m_pairSync.adapter().hasGhostCallback();
    if (isInstalled == m_hasGhostCallback.load(std::memory_order_relaxed))
        return;
    m_ghostBoxes.clear();
    if (isInstalled)
    {
        m_store.forEach(
            [this](const Proxy* proxy, std::uint32_t row)
            {
                if (isGhost(*proxy))
                    m_ghostBoxes.insert(row, m_store.table().box(row));
            });
    }
    m_hasGhostCallback.store(isInstalled, std::memory_order_release);
}

/// Reads the boxes of all ghosts again after the origin of the table's boxes has moved.
void GhostPairs::readBoxesAgain() noexcept
{
    m_recentredTotal = m_store.recentredTotal();
    m_store.forEach(
        [this](const Proxy*, std::uint32_t row)
        {
            if (m_ghostBoxes.contains(row))
                m_ghostBoxes.set(row, m_store.table().box(row));
        });
}

void GhostPairs::add(const Proxy& proxy)
{
    if (!m_hasGhostCallback.load(std::memory_order_relaxed) || !isGhost(proxy))
        return;
    const std::uint32_t row = ProxyStore::rowOf(&proxy);
    m_ghostBoxes.insert(row, m_store.table().box(row));
}

void GhostPairs::remove(const Proxy& proxy)
{
    const std::uint32_t row = ProxyStore::rowOf(&proxy);
    if (m_ghostBoxes.contains(row))
        m_ghostBoxes.erase(row);
}

void GhostPairs::addPairsOfBox(Proxy& proxy, const QueryIndex& index)
{
    const std::uint32_t row = ProxyStore::rowOf(&proxy);
    const Aabb& box = m_store.table().box(row);
    const bool isGhostProxy = m_ghostBoxes.contains(row);
    if (isGhostProxy)
        m_ghostBoxes.set(row, box);
    if (!isValid(box))
        return;
    // Moved out of the member, because a callback of the application may set the box of another proxy during the loop.
    std::vector<std::uint32_t> overlappingIds = std::move(m_overlappingIds);
    overlappingIds.clear();
    const auto collect = [&](std::uint32_t other)
    {
        const Aabb& otherBox = m_store.table().box(other);
        if (other != row && isValid(otherBox) && overlaps(otherBox, box))
            overlappingIds.push_back(m_store.table().uniqueId(other));
    };
    if (isGhostProxy)
    {
        index.forEachOverlap(box, collect);
    }
    else
    {
        m_ghostBoxes.forEachOverlap(box, collect);
    }
    std::sort(overlappingIds.begin(), overlappingIds.end());
    const std::uint32_t uniqueId = uniqueIdOf(&proxy);
    for (const std::uint32_t id : overlappingIds)
    {
        Proxy* other = m_store.find(id);
        if (other != nullptr && m_store.find(uniqueId) == &proxy)
            m_pairSync.addImmediately(proxy, *other);
    }
    m_overlappingIds = std::move(overlappingIds);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
