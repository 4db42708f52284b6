// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

// Shared by the source files of PairCache, and for them only: ids, the search, and the cursor of a pair.

#include "cullet/plugin/core/proxy_ids.h"
#include "cullet/plugin/pair_cache/pair_cache.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
inline Pair idsOf(const ProxyPair& sorted)
{
    return {uniqueIdOf(sorted.first), uniqueIdOf(sorted.second)};
}

inline Pair idsOf(const btBroadphasePair& pair)
{
    return {uniqueIdOf(pair.m_pProxy0), uniqueIdOf(pair.m_pProxy1)};
}

/// The order of btBroadphasePair's constructor.
inline ProxyPair sortById(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
{
    return isLowerId(*proxy0, *proxy1) ? ProxyPair{proxy0, proxy1} : ProxyPair{proxy1, proxy0};
}

class PairCache::Cursor
{
public:
    // Not inlined: GCC 12 would warn of a dangling pointer in m_cursors, although the destructor removes it.
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

    std::uint32_t index;  // kNone once the pair is removed
    bool isDetached =
        false;  // the pair is in neither hash nor lists, and its entry stays while a callback runs

private:
    PairCache& m_cache;
    Cursor* m_outer;
};

/// Counts a change by a caller when it is complete, since an update inside its callbacks would already include it.
class PairCache::CallerChange
{
public:
    explicit CallerChange(PairCache& cache) : m_cache(cache) {}
    ~CallerChange() { ++m_cache.m_changesByCallers; }
    CallerChange(const CallerChange&) = delete;
    CallerChange& operator=(const CallerChange&) = delete;

private:
    PairCache& m_cache;
};

class PairCache::Addition
{
public:
    [[gnu::noinline]] Addition(PairCache& cache, Pair pair)
        : ids(pair), m_cache(cache), m_outer(cache.m_additions)
    {
        cache.m_additions = this;
    }
    ~Addition()
    {
        m_cache.m_additions = m_outer;
        if (reported.first != nullptr)
            m_cache.dropAnchors(ids);
    }
    Addition(const Addition&) = delete;
    Addition& operator=(const Addition&) = delete;

    Addition* outer() const { return m_outer; }

    const Pair ids;
    /// The proxies that the ghost callback has received, and must receive again if the pair is not added; null: none.
    ProxyPair reported = {};
    bool isCancelled = false;

private:
    PairCache& m_cache;
    Addition* m_outer;
};

inline std::uint32_t PairCache::indexOf(const ProxyPair& sorted) const
{
    return m_hash.find(hashOfPair(idsOf(sorted)),
                       [&](std::uint32_t index)
                       {
                           const btBroadphasePair& pair = m_pairs[static_cast<int>(index)];
                           return pair.m_pProxy0 == sorted.first && pair.m_pProxy1 == sorted.second;
                       });
}

inline std::uint32_t PairCache::indexOf(Pair ids) const
{
    const Pair sorted = inBulletsOrder(ids);
    return m_hash.find(hashOfPair(sorted), [&](std::uint32_t index)
                       { return idsOf(m_pairs[static_cast<int>(index)]) == sorted; });
}

/// indexOf() that stats() counts.
inline std::uint32_t PairCache::searchedIndexOf(Pair ids)
{
    ++m_searched;
    return indexOf(ids);
}

/// Whether a callback runs for the removal of the pair.
inline bool PairCache::isBeingRemoved(std::uint32_t index) const
{
    for (const Cursor* cursor = m_cursors; cursor != nullptr; cursor = cursor->outer())
    {
        if (cursor->isDetached && cursor->index == index)
            return true;
    }
    return false;
}

inline btBroadphasePair* PairCache::pairAt(std::uint32_t index)
{
    return index != kNone ? &m_pairs[static_cast<int>(index)] : nullptr;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
