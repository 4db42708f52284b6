// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/ghost_pairs.h"

#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/plugin/pair_sync/grown_box.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <algorithm>
#include <cmath>
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

/// How much larger than its box the reach of a ghost is, on each side.
float skinOf(const Aabb& box) noexcept
{
    const float extents[] = {box.max[0] - box.min[0], box.max[1] - box.min[1], box.max[2] - box.min[2]};
    return 0.75f * std::min({extents[0], extents[1], extents[2]});
}

/// The reach of a ghost that walks from one box, or reach, to another: it lies ahead.
Aabb reachOf(const Aabb& former, const Aabb& box) noexcept
{
    const float skin = skinOf(box);
    Aabb reach = grown(box, skin);
    for (int axis = 0; axis < 3; ++axis)
    {
        const float way =
            0.5f * box.min[axis] + 0.5f * box.max[axis] - 0.5f * former.min[axis] - 0.5f * former.max[axis];
        const float ahead = std::clamp(way, -0.5f * skin, 0.5f * skin);
        reach.min[axis] += ahead;
        reach.max[axis] += ahead;
    }
    return reach;
}

/// Whether a ghost that was in `former`, its box or its reach, will stay inside a reach for some more moves like this.
bool isWalking(const Aabb& former, const Aabb& box) noexcept
{
    constexpr float kMoves = 4;
    const float skin = skinOf(box);
    return skin > 0 && std::isfinite(skin) && box != former && encloses(grown(former, skin / kMoves), box) &&
           encloses(grown(box, kMoves * skin), former);
}
}  // namespace

GhostPairs::GhostPairs(ProxyStore& store, PairSync& pairSync) : m_store(store), m_pairSync(pairSync)
{
    m_pairSync.observeRemovals([this](const Pairs& pairs) { forgetPaired(pairs); });
}

void GhostPairs::rescan()
{
    const std::lock_guard<std::mutex> lock(m_rescan);
    const bool isInstalled = m_pairSync.adapter().hasGhostCallback();
    if (isInstalled == m_hasGhostCallback.load(std::memory_order_relaxed))
        return;
    m_ghostBoxes.clear();
    m_neighbours.clear();
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
    m_neighbours.clear();
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
    if (!m_ghostBoxes.contains(row))
        return;
    m_ghostBoxes.erase(row);
    m_neighbours.drop(row);
}

/// Visits the other ghosts whose box or reach overlaps the box, and adds the row to the lists of those.
template <class Visit>
void GhostPairs::visitGhostsNear(std::uint32_t row, const Aabb& box, Visit visit)
{
    m_ghostBoxes.forEachOverlap(box,
                                [&](std::uint32_t ghost)
                                {
                                    if (ghost == row)
                                        return;
                                    if (m_neighbours.isListed(ghost))
                                        m_neighbours.add(ghost, row);
                                    visit(ghost);
                                });
}

/// Makes the list of a ghost that walks; false where it must do without.
bool GhostPairs::listNeighbours(std::uint32_t row, const Aabb& box, const QueryIndex& index)
{
    const Aabb former = m_ghostBoxes.box(row);
    if (!isWalking(former, box))
        return false;
    const Aabb reach = reachOf(former, box);
    if (!m_neighbours.begin(row, reach))
        return false;
    m_ghostBoxes.set(row, reach);
    const auto list = [&](std::uint32_t other)
    {
        if (m_neighbours.isListed(row))
            m_neighbours.add(row, other);
    };
    visitGhostsNear(row, reach, list);
    const auto listBody = [&](std::uint32_t other)
    {
        if (!m_ghostBoxes.contains(other))
            list(other);
    };
    // Between any two searches ghosts have walked on: among few rows their tree takes longer to follow than a scan.
    constexpr std::uint32_t kFewRows = 512;
    if (m_store.table().size() <= kFewRows)
        index.scanOverlap(reach, listBody);
    else
        index.forEachOverlap(reach, listBody);
    if (m_neighbours.isListed(row))
        return true;
    m_neighbours.postpone(row);
    return false;
}

/// Visits rows that may overlap the new box of a ghost, all whose pairs may be missing among them.
template <class Visit>
void GhostPairs::visitNearGhost(const Proxy& ghost, const Aabb& box, const QueryIndex& index, Visit& visit)
{
    const std::uint32_t row = ProxyStore::rowOf(&ghost);
    if (m_neighbours.isInReach(row, box) || listNeighbours(row, box, index))
        return m_neighbours.forEachUnpaired(row, visit);
    m_neighbours.drop(row);
    m_ghostBoxes.set(row, box);
    if (m_neighbours.isAnyListed())
        visitGhostsNear(row, box, [](std::uint32_t) {});
    index.forEachOverlap(box, visit);
}

/// Records which of the pairs of a proxy that may be new are in the cache now, after callbacks of the application.
void GhostPairs::recordPaired(Proxy& proxy, const std::vector<std::uint32_t>& ids)
{
    if (!m_neighbours.isAnyListed() || !m_pairSync.adapter().countsExternalChanges())
        return;
    for (const std::uint32_t id : ids)
    {
        Proxy* other = m_store.find(id);
        if (other != nullptr && m_pairSync.hasOverlap(proxy, *other))
            m_neighbours.setPaired(ProxyStore::rowOf(&proxy), ProxyStore::rowOf(other), true);
    }
}

/// Forgets that pairs are in the cache, which they are about to leave.
void GhostPairs::forgetPaired(const Pairs& pairs) noexcept
{
    if (!m_neighbours.isAnyListed())
        return;
    for (const Pair pair : pairs)
    {
        const Proxy* const first = m_store.find(pair.first);
        const Proxy* const second = m_store.find(pair.second);
        if (first != nullptr && second != nullptr)
            m_neighbours.setPaired(ProxyStore::rowOf(first), ProxyStore::rowOf(second), false);
    }
}

/// Forgets which pairs are in the cache after the application has changed it.
void GhostPairs::followCache() noexcept
{
    const std::uint64_t changes = m_pairSync.adapter().externalChanges();
    if (changes == m_externalChanges)
        return;
    m_externalChanges = changes;
    m_neighbours.forgetPaired();
}

void GhostPairs::addPairsOfBox(Proxy& proxy, const QueryIndex& index)
{
    followCache();
    const std::uint32_t row = ProxyStore::rowOf(&proxy);
    const Aabb& box = m_store.table().box(row);
    const bool isGhostProxy = m_ghostBoxes.contains(row);
    if (!isValid(box))
    {
        m_neighbours.drop(row);
        if (isGhostProxy)
            m_ghostBoxes.set(row, box);
        return;
    }
    // Moved out of the member, because a callback of the application may set the box of another proxy during the loop.
    std::vector<std::uint32_t> overlappingIds = std::move(m_overlappingIds);
    overlappingIds.clear();
    const auto collect = [&](std::uint32_t other)
    {
        // Whether the other box is valid is tested when the pair is added.
        if (other != row && overlapsBranchless(m_store.table().box(other), box))
            overlappingIds.push_back(m_store.table().uniqueId(other));
    };
    if (isGhostProxy)
        visitNearGhost(proxy, box, index, collect);
    else
        visitGhostsNear(row, box, collect);
    std::sort(overlappingIds.begin(), overlappingIds.end());
    const std::uint32_t uniqueId = uniqueIdOf(&proxy);
    for (const std::uint32_t id : overlappingIds)
    {
        Proxy* other = m_store.find(id);
        if (other != nullptr && m_store.find(uniqueId) == &proxy)
            m_pairSync.addImmediately(proxy, *other);
    }
    if (m_store.find(uniqueId) == &proxy)
        recordPaired(proxy, overlappingIds);
    m_overlappingIds = std::move(overlappingIds);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
