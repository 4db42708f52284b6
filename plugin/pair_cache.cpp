// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "plugin/pair_cache.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>
#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>

#include <algorithm>
#include <new>
#include <utility>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr std::uint32_t kMaxPairs = PairLinks::kMaxPairs;  // below what Bullet's int counts
constexpr std::size_t kSmallestArray = 16;

std::uint32_t idOf(const btBroadphaseProxy* proxy)
{
    return static_cast<std::uint32_t>(proxy->m_uniqueId);
}

Pair idsOf(const ProxyPair& sorted)
{
    return {idOf(sorted.first), idOf(sorted.second)};
}

Pair idsOf(const btBroadphasePair& pair)
{
    return {idOf(pair.m_pProxy0), idOf(pair.m_pProxy1)};
}

/// The comparison of btBroadphasePair's constructor.
ProxyPair sortById(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
{
    return proxy0->m_uniqueId < proxy1->m_uniqueId ? ProxyPair{proxy0, proxy1} : ProxyPair{proxy1, proxy0};
}

void destroyAlgorithm(btBroadphasePair& pair, btDispatcher* dispatcher)
{
    // Taken out first: the destructor may call back into the cache and meet this pair again.
    btCollisionAlgorithm* algorithm = std::exchange(pair.m_algorithm, nullptr);
    algorithm->~btCollisionAlgorithm();
    dispatcher->freeCollisionAlgorithm(algorithm);
}
}  // namespace

class PairCache::Cursor
{
public:
    // Not inlined: GCC 12 would warn of a dangling pointer in m_cursors, although the destructor takes it out.
    [[gnu::noinline]] Cursor(PairCache& cache, std::uint32_t pair)
        : index(pair), m_cache(cache), m_outer(cache.m_cursors)
    {
        cache.m_cursors = this;
    }
    ~Cursor() { m_cache.m_cursors = m_outer; }
    Cursor(const Cursor&) = delete;
    Cursor& operator=(const Cursor&) = delete;

    void moved(std::uint32_t from, std::uint32_t to)
    {
        if (index == from)
            index = to;
    }
    Cursor* outer() const { return m_outer; }

    std::uint32_t index;  // kNone once the pair is gone

private:
    PairCache& m_cache;
    Cursor* m_outer;
};

btBroadphasePair* PairCache::getOverlappingPairArrayPtr()
{
    return m_pairs.size() > 0 ? &m_pairs[0] : nullptr;
}

const btBroadphasePair* PairCache::getOverlappingPairArrayPtr() const
{
    return m_pairs.size() > 0 ? &m_pairs[0] : nullptr;
}

bool PairCache::needsBroadphaseCollision(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1) const
{
    if (m_filter != nullptr)
        return m_filter->needBroadphaseCollision(proxy0, proxy1);
    return (proxy0->m_collisionFilterGroup & proxy1->m_collisionFilterMask) != 0 &&
           (proxy1->m_collisionFilterGroup & proxy0->m_collisionFilterMask) != 0;
}

// Search.

std::uint32_t PairCache::indexOf(const ProxyPair& sorted) const
{
    return m_hash.find(hashOfPair(idsOf(sorted)),
                       [&](std::uint32_t index)
                       {
                           const btBroadphasePair& pair = m_pairs[static_cast<int>(index)];
                           return pair.m_pProxy0 == sorted.first && pair.m_pProxy1 == sorted.second;
                       });
}

std::uint32_t PairCache::indexOf(Pair ids) const
{
    return m_hash.find(hashOfPair(ids),
                       [&](std::uint32_t index) { return idsOf(m_pairs[static_cast<int>(index)]) == ids; });
}

btBroadphasePair* PairCache::findPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
{
    return pairAt(indexOf(sortById(proxy0, proxy1)));
}

btBroadphasePair* PairCache::findPair(Pair ids)
{
    return pairAt(indexOf(ids));
}

btBroadphasePair* PairCache::pairAt(std::uint32_t index)
{
    return index != kNone ? &m_pairs[static_cast<int>(index)] : nullptr;
}

// Adding.

void PairCache::reserve(std::size_t pairCount)
{
    try
    {
        if (pairCount > size())
            growTo(std::min<std::size_t>(pairCount, kMaxPairs));
    }
    catch (const std::bad_alloc&)
    {
        // Adding will try again with what it needs.
    }
}

/// Makes room for so many pairs in everything but the anchors; what has to grow grows by a quarter at least, so that growing
/// in small steps stays cheap. Throws std::bad_alloc.
void PairCache::growTo(std::size_t pairCount)
{
    const std::size_t quarterMore = size() + size() / 4;
    const std::size_t count =
        std::min<std::size_t>(std::max({pairCount, quarterMore, kSmallestArray}), kMaxPairs);
    if (m_hash.limit() < pairCount)
        m_hash.grow(count, [this](std::uint32_t index) { return hashOfPair(idsOf(*pairAt(index))); });
    if (m_links.capacity() < pairCount)
        m_links.reserve(count);
    if (static_cast<std::size_t>(m_pairs.capacity()) < pairCount)
        m_pairs.reserve(static_cast<int>(count));
}

/// Makes room for one more pair in everything but the anchors; throws std::bad_alloc.
void PairCache::makeRoom()
{
    if (m_hash.hasRoom() && size() < m_links.capacity() && m_pairs.size() < m_pairs.capacity())
        return;
    if (size() >= kMaxPairs)
        throw std::bad_alloc();
    growTo(size() + 1);
}

btBroadphasePair* PairCache::addOverlappingPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
{
    return needsBroadphaseCollision(proxy0, proxy1) ? addPairUnfiltered(proxy0, proxy1) : nullptr;
}

btBroadphasePair* PairCache::addPairUnfiltered(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
{
    if (proxy0->m_uniqueId == proxy1->m_uniqueId)
        return nullptr;
    const ProxyPair sorted = sortById(proxy0, proxy1);
    const std::uint32_t known = indexOf(sorted);
    if (known != kNone)
        return pairAt(known);
    if (m_ghosts == nullptr)
        return append(sorted);

    if (!hasMemory(sorted))
        return nullptr;
    m_ghosts->addOverlappingPair(sorted.first, sorted.second);
    // The callback may have changed the cache, up to adding this very pair.
    const std::uint32_t added = indexOf(sorted);
    return added != kNone ? pairAt(added) : append(sorted);
}

/// Whether append() will find the memory it needs.
bool PairCache::hasMemory(const ProxyPair& sorted)
{
    try
    {
        makeRoom();
        m_links.anchorsOf(idsOf(sorted));
        return true;
    }
    catch (const std::bad_alloc&)
    {
        return false;
    }
}

btBroadphasePair* PairCache::append(const ProxyPair& sorted)
{
    const Pair ids = idsOf(sorted);
    try
    {
        makeRoom();
        m_links.append(m_links.anchorsOf(ids));
    }
    catch (const std::bad_alloc&)
    {
        return nullptr;
    }
    m_hash.insert(hashOfPair(ids), size());
    ++m_version;
    return new (&m_pairs.expandNonInitializing()) btBroadphasePair(*sorted.first, *sorted.second);
}

// Removing.

void PairCache::cleanOverlappingPair(btBroadphasePair& pair, btDispatcher* dispatcher)
{
    if (pair.m_algorithm != nullptr && dispatcher != nullptr)
        destroyAlgorithm(pair, dispatcher);
}

void PairCache::cleanProxyFromPairs(btBroadphaseProxy* proxy, btDispatcher* dispatcher)
{
    if (dispatcher == nullptr)
        return;
    const std::uint32_t id = idOf(proxy);
    Cursor cursor(*this, kNone);
    for (std::uint32_t node = m_links.first(id); node != kNone;)
    {
        const std::uint32_t side = node % 2;
        cursor.index = PairLinks::pairOf(node);
        ++m_visited;
        cleanOverlappingPair(*pairAt(cursor.index), dispatcher);
        // From the front again when the destructor took the pair out: those already clean cost little.
        node = cursor.index == kNone ? m_links.first(id) : m_links.next(2 * cursor.index + side);
    }
}

void* PairCache::removeOverlappingPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1,
                                       btDispatcher* dispatcher)
{
    const std::uint32_t index = indexOf(sortById(proxy0, proxy1));
    return index != kNone ? removeAt(index, dispatcher) : nullptr;
}

void* PairCache::removePair(Pair ids, btDispatcher* dispatcher)
{
    const std::uint32_t index = indexOf(ids);
    return index != kNone ? removeAt(index, dispatcher) : nullptr;
}

void PairCache::removeOverlappingPairsContainingProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher)
{
    const std::uint32_t id = idOf(proxy);
    for (std::uint32_t node = m_links.first(id); node != kNone; node = m_links.first(id))
    {
        ++m_visited;
        removeAt(PairLinks::pairOf(node), dispatcher);
    }
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
    return cursor.index != kNone ? removeFollowed(cursor, dispatcher) : nullptr;
}

void* PairCache::removeFollowed(const Cursor& cursor, btDispatcher* dispatcher)
{
    const btBroadphasePair pair = *pairAt(cursor.index);
    detach(cursor.index);
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

/// Takes the pair out of hash and lists; its entry in the array stays.
void PairCache::detach(std::uint32_t index)
{
    const Pair ids = idsOf(*pairAt(index));
    m_hash.erase(hashOfPair(ids), index);
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
    m_links.popBack();
    m_pairs.pop_back();
    ++m_version;
}

void PairCache::movePair(std::uint32_t from, std::uint32_t to)
{
    *pairAt(to) = *pairAt(from);
    if (m_detachedCount != 0 && m_links.isDetached(from))
    {
        m_links.markDetached(to);
        return;
    }
    m_hash.replace(hashOfPair(idsOf(*pairAt(from))), from, to);
    m_links.move(from, to);
}

// Processing.

void PairCache::processAllOverlappingPairs(btOverlapCallback* callback, btDispatcher* dispatcher)
{
    Cursor cursor(*this, kNone);
    for (std::uint32_t index = 0; index < size();)
    {
        if (m_detachedCount != 0 && m_links.isDetached(index))
        {
            ++index;
            continue;
        }
        cursor.index = index;
        ++m_visited;
        const bool isDone = callback->processOverlap(*pairAt(index));
        if (isDone && cursor.index != kNone)
            removeAt(cursor.index, dispatcher);
        // The pair is still in its place, unless it was removed or moved; then another one awaits its visit there.
        if (cursor.index == index)
            ++index;
    }
}

void PairCache::processAllOverlappingPairs(btOverlapCallback* callback, btDispatcher* dispatcher,
                                           const btDispatcherInfo& dispatchInfo)
{
    if (dispatchInfo.m_deterministicOverlappingPairs && order())
    {
        processOrdered(callback, dispatcher);
    }
    else
    {
        processAllOverlappingPairs(callback, dispatcher);
    }
}

/// Brings m_order up to date; false when there is no memory for it.
bool PairCache::order()
{
    if (m_order.isOf(m_version))
        return true;
    try
    {
        m_order.reserve(static_cast<std::size_t>(m_pairs.capacity()));  // grows as rarely as the array
    }
    catch (const std::bad_alloc&)
    {
        return false;
    }
    for (std::uint32_t index = 0; index < size(); ++index)
    {
        if (m_detachedCount == 0 || !m_links.isDetached(index))
            m_order.add({idsOf(*pairAt(index)), index});
    }
    m_order.sort(m_version);
    return true;
}

void PairCache::processOrdered(btOverlapCallback* callback, btDispatcher* dispatcher)
{
    // Taken out, so that a nested call sorts for itself.
    PairOrder sorted = std::exchange(m_order, PairOrder());
    Cursor cursor(*this, kNone);
    for (const PairOrder::Entry& entry : sorted.entries())
    {
        const bool isUnchanged = sorted.isOf(m_version) && m_detachedCount == 0;
        cursor.index = isUnchanged ? entry.index : indexOf(entry.ids);
        if (cursor.index == kNone)
            continue;
        ++m_visited;
        const bool isDone = callback->processOverlap(*pairAt(cursor.index));
        if (isDone && cursor.index != kNone)
            removeAt(cursor.index, dispatcher);
    }
    m_order = std::move(sorted);
}

void PairCache::sortOverlappingPairs(btDispatcher* /*dispatcher*/)
{
    if (m_cursors != nullptr || !order())
        return;
    std::vector<btBroadphasePair> sorted;
    try
    {
        sorted.reserve(size());
    }
    catch (const std::bad_alloc&)
    {
        return;
    }
    for (const PairOrder::Entry& entry : m_order.entries())
        sorted.push_back(*pairAt(entry.index));
    m_hash.clear();
    m_links.clear();
    for (std::uint32_t index = 0; index < size(); ++index)
    {
        const Pair ids = idsOf(sorted[index]);
        *pairAt(index) = sorted[index];
        m_hash.insert(hashOfPair(ids), index);
        m_links.append(m_links.anchorsOf(ids));  // both exist
    }
    ++m_version;
}

// Numbers.

std::uint64_t PairCache::bytes() const
{
    return static_cast<std::uint64_t>(m_pairs.capacity()) * sizeof(btBroadphasePair) + m_hash.bytes() +
           m_links.bytes() + m_order.bytes();
}

PairCacheStats PairCache::stats() const
{
    PairCacheStats stats;
    stats.pairs = size();
    stats.slots = m_hash.slotCount();
    stats.load = static_cast<double>(stats.pairs) / static_cast<double>(stats.slots);
    std::uint64_t probes = 0;
    for (std::uint32_t index = 0; index < size(); ++index)
    {
        const Pair ids = idsOf(m_pairs[static_cast<int>(index)]);
        const std::uint64_t probesOfPair = m_hash.probesOf(hashOfPair(ids), index);
        probes += probesOfPair;
        stats.longestProbe = std::max(stats.longestProbe, probesOfPair);
    }
    if (size() > 0)
        stats.meanProbe = static_cast<double>(probes) / size();
    stats.rehashes = m_hash.rehashes();
    stats.proxies = m_links.listCount();
    stats.visited = m_visited;
    stats.bytes = bytes();
    return stats;
}

bool PairCache::isConsistent() const
{
    if (m_hash.size() != size())
        return false;
    std::uint64_t passedBy = 0;
    for (std::uint32_t index = 0; index < size(); ++index)
    {
        const btBroadphasePair& pair = m_pairs[static_cast<int>(index)];
        if (pair.m_pProxy0->m_uniqueId >= pair.m_pProxy1->m_uniqueId)
            return false;
        if (indexOf(idsOf(pair)) != index)
            return false;
        passedBy += m_hash.probesOf(hashOfPair(idsOf(pair)), index) - 1;
    }
    if (m_hash.passedByCount() != passedBy)
        return false;
    return m_links.isConsistent(size(),
                                [&](std::uint32_t pair) { return idsOf(m_pairs[static_cast<int>(pair)]); });
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
