// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_cache/pair_cache.h"

#include "cullet/plugin/pair_cache/pair_cache_parts.h"

#include <algorithm>
#include <new>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr std::uint32_t kMaxPairs = PairLinks::kMaxPairs;  // below the limit of Bullet's int
constexpr std::size_t kSmallestArray = 16;
}  // namespace

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

btBroadphasePair* PairCache::findPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
{
    return pairAt(indexOf(sortById(proxy0, proxy1)));
}

btBroadphasePair* PairCache::findPair(Pair ids)
{
    return pairAt(indexOf(ids));
}

void PairCache::reserve(std::size_t pairCount)
{
    try
    {
        if (pairCount > size())
            growTo(std::min<std::size_t>(pairCount, kMaxPairs));
    }
    catch (const std::bad_alloc&)
    {
        // Adding a pair will try again with the memory that it needs.
    }
}

/// Reserves memory for a number of pairs, except anchors; what has to grow grows by at least a quarter, so that growing
/// in small steps is cheap, or by a 32nd without links. Throws std::bad_alloc.
void PairCache::growTo(std::size_t pairCount)
{
    const std::size_t someMore = size() + size() / (m_isLinked ? 4 : 32);
    const std::size_t count =
        std::min<std::size_t>(std::max({pairCount, someMore, kSmallestArray}), kMaxPairs);
    if (m_hash.limit() < pairCount)
        m_hash.grow(
            count, [this](std::uint32_t index) { return hashOfPair(idsOf(*pairAt(index))); },
            [this](std::uint32_t index) { return !isDetached(index); });
    if (m_isLinked && m_links.capacity() < pairCount)
        m_links.reserve(count);
    if (static_cast<std::size_t>(m_pairs.capacity()) < pairCount)
        m_pairs.reserve(static_cast<int>(count));
}

void PairCache::setLinked(bool isLinked)
{
    if (isLinked == m_isLinked || m_cursors != nullptr || m_additions != nullptr)
        return;
    m_links = PairLinks();
    m_isLinked = isLinked;
    if (isLinked)
        makeLinks();
}

/// Links all pairs, in the order of the array, or none for lack of memory.
void PairCache::makeLinks()
{
    try
    {
        m_links.reserve(static_cast<std::size_t>(m_pairs.capacity()));
        for (std::uint32_t index = 0; index < size(); ++index)
            m_links.append(m_links.anchorsOf(idsOf(*pairAt(index))));
    }
    catch (const std::bad_alloc&)
    {
        m_links = PairLinks();
        m_isLinked = false;
    }
}

/// Reserves memory for one more pair, except anchors; throws std::bad_alloc.
inline void PairCache::makeRoom()
{
    if (hasRoom())
        return;
    if (size() >= kMaxPairs)
        throw std::bad_alloc();
    growTo(size() + 1);
}

btBroadphasePair* PairCache::addOverlappingPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
{
    const CallerChange change(*this);
    return addPair(proxy0, proxy1);
}

btBroadphasePair* PairCache::addPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
{
    return addFiltered(proxy0, proxy1, false);
}

btBroadphasePair* PairCache::addAbsent(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
{
    return addFiltered(proxy0, proxy1, true);
}

/// @param isAbsent whether the cache is known to lack the pair before the callbacks run
inline btBroadphasePair* PairCache::addFiltered(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1,
                                                bool isAbsent)
{
    const ProxyPair sorted = sortById(proxy0, proxy1);
    if (isBeingAdded(sorted))
        return pairAt(indexOf(sorted));
    if (m_filter == nullptr)
        return needsBroadphaseCollision(proxy0, proxy1) ? addAccepted(sorted, isAbsent) : nullptr;
    const std::uint64_t before = m_version;
    Addition addition(*this, idsOf(sorted));
    if (!m_filter->needBroadphaseCollision(proxy0, proxy1) || addition.isCancelled)
        return nullptr;
    return addAccepted(sorted, isAbsent && m_version == before);
}

btBroadphasePair* PairCache::addPairUnfiltered(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
{
    const ProxyPair sorted = sortById(proxy0, proxy1);
    return isBeingAdded(sorted) ? pairAt(indexOf(sorted)) : addAccepted(sorted, false);
}

bool PairCache::appendNew(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
{
    return append(sortById(proxy0, proxy1)) != nullptr;
}

/// Adds a pair that the filter lets pass, or returns the existing one.
btBroadphasePair* PairCache::addAccepted(const ProxyPair& sorted, bool isAbsent)
{
    if (sorted.first->m_uniqueId == sorted.second->m_uniqueId)
        return nullptr;
    if (!isAbsent)
    {
        ++m_searched;
        const std::uint32_t known = indexOf(sorted);
        if (known != kNone)
            return pairAt(known);
    }
    if (m_ghosts == nullptr)
        return append(sorted);
    Addition addition(*this, idsOf(sorted));
    return addReported(sorted, addition);
}

/// Whether the filter or the ghost callback for an addition of this same pair is running.
bool PairCache::isBeingAdded(const ProxyPair& sorted) const
{
    for (const Addition* addition = m_additions; addition != nullptr; addition = addition->outer())
    {
        if (addition->ids == idsOf(sorted))
            return true;
    }
    return false;
}

btBroadphasePair* PairCache::addReported(const ProxyPair& sorted, Addition& addition)
{
    if (!hasMemory(sorted))
        return nullptr;
    addition.reported = sorted;
    report(addition);
    // The callback may have changed the cache.
    btBroadphasePair* const pair = addition.isCancelled ? nullptr : append(sorted);
    if (pair != nullptr)
        addition.reported = {};  // nothing is to be undone
    return pair;
}

/// Calls the ghost callback for a new pair.
void PairCache::report(const Addition& addition)
{
    btOverlappingPairCallback& ghosts = *m_ghosts;
    const ProxyPair pair = addition.reported;
    try
    {
        ghosts.addOverlappingPair(pair.first, pair.second);
    }
    catch (...)
    {
        // Without memory, Bullet's callback may have added one body to a ghost, and not that ghost to the other one.
        if (!addition.isCancelled)
            ghosts.removeOverlappingPair(pair.first, pair.second, nullptr);
        throw;
    }
}

/// Reserves the memory that append() needs; false if there is none.
bool PairCache::hasMemory(const ProxyPair& sorted)
{
    try
    {
        makeRoom();
        if (m_isLinked)
            m_links.anchorsOf(idsOf(sorted));
        return true;
    }
    catch (const std::bad_alloc&)
    {
        ++m_pairsWithoutMemory;
        return false;
    }
}

/// Whether an addition in progress needs the anchor of this proxy: one for which hasMemory() was true.
bool PairCache::isAnchorNeeded(std::uint32_t id) const noexcept
{
    for (const Addition* addition = m_additions; addition != nullptr; addition = addition->outer())
    {
        if (addition->reported.first != nullptr && (addition->ids.first == id || addition->ids.second == id))
            return true;
    }
    return false;
}

/// Frees the anchors that hasMemory() created for a pair that is not added, because of a cancellation or an exception.
void PairCache::dropAnchors(Pair ids) noexcept
{
    for (const std::uint32_t id : {ids.first, ids.second})
    {
        if (!isAnchorNeeded(id))
            m_links.dropIfUnused(id);
    }
}

btBroadphasePair* PairCache::append(const ProxyPair& sorted)
{
    const Pair ids = idsOf(sorted);
    try
    {
        makeRoom();
        if (m_isLinked)
            m_links.append(m_links.anchorsOf(ids));
    }
    catch (const std::bad_alloc&)
    {
        ++m_pairsWithoutMemory;
        return nullptr;
    }
    m_hash.insert(hashOfPair(ids), size());
    ++m_version;
    return new (&m_pairs.expandNonInitializing()) btBroadphasePair(*sorted.first, *sorted.second);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
