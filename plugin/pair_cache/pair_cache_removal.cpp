// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Removal of pairs and of their algorithms.

#include "cullet/plugin/pair_cache/pair_cache_parts.h"

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>

#include <utility>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
void destroyAlgorithm(btBroadphasePair& pair, btDispatcher* dispatcher)
{
    // Cleared first: the destructor may call back into the cache and find this pair again.
    btCollisionAlgorithm* algorithm = std::exchange(pair.m_algorithm, nullptr);
    algorithm->~btCollisionAlgorithm();
    dispatcher->freeCollisionAlgorithm(algorithm);
}
}  // namespace

void PairCache::cleanOverlappingPair(btBroadphasePair& pair, btDispatcher* dispatcher)
{
    if (pair.m_algorithm != nullptr && dispatcher != nullptr)
        destroyAlgorithm(pair, dispatcher);
}

void PairCache::cleanProxyFromPairs(btBroadphaseProxy* proxy, btDispatcher* dispatcher)
{
    if (dispatcher == nullptr)
        return;
    if (!m_isLinked)
        return cleanByScan(proxy, dispatcher);
    const std::uint32_t id = uniqueIdOf(proxy);
    Cursor cursor(*this, kNone);
    for (std::uint32_t node = m_links.first(id); node != kNone;)
    {
        const std::uint32_t side = node % 2;
        cursor.index = PairLinks::pairOf(node);
        ++m_visited;
        cleanOverlappingPair(*pairAt(cursor.index), dispatcher);
        // Restarts at the front if the destructor removed the pair: pairs without an algorithm cost little.
        node = cursor.index == kNone ? m_links.first(id) : m_links.next(2 * cursor.index + side);
    }
}

void* PairCache::removeOverlappingPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1,
                                       btDispatcher* dispatcher)
{
    const CallerChange change(*this);
    const ProxyPair sorted = sortById(proxy0, proxy1);
    const std::uint32_t index = indexOf(sorted);
    return index != kNone ? removeAt(index, dispatcher) : cancelAddition(idsOf(sorted), dispatcher);
}

void* PairCache::removePair(Pair ids, btDispatcher* dispatcher)
{
    const std::uint32_t index = indexOf(ids);
    return index != kNone ? removeAt(index, dispatcher) : cancelAddition(inBulletsOrder(ids), dispatcher);
}

void PairCache::removeOverlappingPairsContainingProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher)
{
    const CallerChange change(*this);
    removePairsOf(proxy, dispatcher);
}

void PairCache::removePairsOf(btBroadphaseProxy* proxy, btDispatcher* dispatcher)
{
    const std::uint32_t id = uniqueIdOf(proxy);
    if (!m_isLinked)
        removeByScan(proxy, dispatcher);
    for (std::uint32_t node = m_links.first(id); node != kNone; node = m_links.first(id))
    {
        ++m_visited;
        removeAt(PairLinks::pairOf(node), dispatcher);
    }
    cancelAdditions([id](Pair ids) { return ids.first == id || ids.second == id; }, dispatcher);
}

bool PairCache::isPairOf(std::uint32_t index, const btBroadphaseProxy* proxy) const
{
    const btBroadphasePair& pair = m_pairs[static_cast<int>(index)];
    return (pair.m_pProxy0 == proxy || pair.m_pProxy1 == proxy) && !isDetached(index);
}

void PairCache::cleanByScan(const btBroadphaseProxy* proxy, btDispatcher* dispatcher)
{
    for (std::uint32_t index = 0; index < size();)
    {
        if (!isPairOf(index, proxy))
        {
            ++index;
            continue;
        }
        const std::uint64_t before = m_version;
        ++m_visited;
        cleanOverlappingPair(*pairAt(index), dispatcher);
        // Begins again if the destructor has moved pairs: those without an algorithm cost little.
        index = m_version == before ? index + 1 : 0;
    }
}

/// Removes the pairs of the proxy from the end of the array on, so that what moves into a hole has been looked at.
void PairCache::removeByScan(const btBroadphaseProxy* proxy, btDispatcher* dispatcher)
{
    for (std::uint32_t end = size(); end > 0;)
    {
        if (!isPairOf(end - 1, proxy))
        {
            --end;
            continue;
        }
        const std::uint64_t before = m_version;
        ++m_visited;
        removeAt(end - 1, dispatcher);
        // Begins again if a callback has changed more than this pair.
        end = m_version == before + 1 ? end - 1 : size();
    }
}

template <class IsAffected>
void PairCache::cancelAdditions(IsAffected isAffected, btDispatcher* dispatcher)
{
    for (Addition* addition = m_additions; addition != nullptr; addition = addition->outer())
    {
        if (addition->isCancelled || !isAffected(addition->ids))
            continue;
        addition->isCancelled = true;
        const ProxyPair reported = addition->reported;
        if (reported.first != nullptr && m_ghosts != nullptr)
            m_ghosts->removeOverlappingPair(reported.first, reported.second, dispatcher);
    }
}

/// @return null, since the pair has no `m_internalInfo1` yet
void* PairCache::cancelAddition(Pair ids, btDispatcher* dispatcher)
{
    if (m_additions != nullptr)
        cancelAdditions([ids](Pair other) { return other == ids; }, dispatcher);
    return nullptr;
}

void* PairCache::removeAt(std::uint32_t index, btDispatcher* dispatcher)
{
    const btBroadphasePair& pair = *pairAt(index);
    if (m_ghosts != nullptr || (pair.m_algorithm != nullptr && dispatcher != nullptr))
    {
        return removeWithCallbacks(index, dispatcher);
    }
    void* info = pair.m_internalInfo1;
    detach(index);
    fillHole(index);
    return info;
}

void* PairCache::removeWithCallbacks(std::uint32_t index, btDispatcher* dispatcher)
{
    Cursor cursor(*this, index);
    cleanOverlappingPair(*pairAt(index), dispatcher);
    // The destructor of the algorithm may have removed the pair.
    return cursor.index != kNone ? removeTracked(cursor, dispatcher) : nullptr;
}

void* PairCache::removeTracked(Cursor& cursor, btDispatcher* dispatcher)
{
    const btBroadphasePair pair = *pairAt(cursor.index);
    detach(cursor.index);
    cursor.isDetached = true;
    ++m_detachedCount;
    try
    {
        if (m_ghosts != nullptr)
            m_ghosts->removeOverlappingPair(pair.m_pProxy0, pair.m_pProxy1, dispatcher);
    }
    catch (...)
    {
        fillDetached(cursor.index);
        throw;
    }
    fillDetached(cursor.index);
    return pair.m_internalInfo1;
}

void PairCache::fillDetached(std::uint32_t hole)
{
    --m_detachedCount;
    fillHole(hole);
}

/// Removes the pair from hash and lists; its entry in the array stays.
void PairCache::detach(std::uint32_t index)
{
    const Pair ids = idsOf(*pairAt(index));
    m_hash.erase(hashOfPair(ids), index);
    if (m_isLinked)
        m_links.detach(index, ids);
}

/// Moves the last pair into the entry of a detached one.
void PairCache::fillHole(std::uint32_t hole)
{
    const std::uint32_t last = size() - 1;
    for (Cursor* cursor = m_cursors; cursor != nullptr; cursor = cursor->outer())
    {
        cursor->moved(hole, kNone);
        cursor->moved(last, hole);
    }
    if (hole != last)
        movePair(last, hole);
    if (m_isLinked)
        m_links.popBack();
    m_pairs.pop_back();
    ++m_version;
}

void PairCache::movePair(std::uint32_t from, std::uint32_t to)
{
    ++m_moved;
    *pairAt(to) = *pairAt(from);
    // Its cursor is at the new entry already.
    if (isDetached(to))
        return;
    m_hash.replace(hashOfPair(idsOf(*pairAt(from))), from, to);
    if (m_isLinked)
        m_links.move(from, to);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
