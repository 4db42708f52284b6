// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/tests/plugin/pair_cache/pair_cache_support.h"

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace cullet::test
{
/// A pair cache and a std::map that has to agree with it, also for calls from within the cache's callbacks.
///
/// With a ghost callback its calls keep the map, and `onCallback` may call any method. Without one the map is changed
/// after each call, so that only passes and filters call back.
class PairCacheTwin
{
public:
    using Ids = RowPair;  ///< as int, the lower one first

    PairCacheTwin(Proxies& proxies, bool hasGhosts) : m_proxies(proxies), m_hasGhosts(hasGhosts)
    {
        m_ghosts.onAdd = [this](btBroadphaseProxy* a, btBroadphaseProxy* b) {
            ghostAdds({a->m_uniqueId, b->m_uniqueId});
        };
        m_ghosts.onRemove = [this](btBroadphaseProxy* a, btBroadphaseProxy* b) {
            ghostRemoves({a->m_uniqueId, b->m_uniqueId});
        };
        if (hasGhosts)
            m_cache.setInternalGhostPairCallback(&m_ghosts);
    }

    ~PairCacheTwin()
    {
        const auto leaked = std::exchange(m_leaked, {});
        for (FakeDispatcher::Algorithm* algorithm : leaked)
        {
            algorithm->~Algorithm();
            m_dispatcher.freeCollisionAlgorithm(algorithm);
        }
    }

    /// Called in each callback with the pair that it is for.
    std::function<void(Ids)> onCallback = [](Ids) {};
    const std::string& fault() const { return m_fault; }

    void useFilter(bool isUsed) { m_cache.setOverlapFilterCallback(isUsed ? &m_filter : nullptr); }

    void add(std::size_t a, std::size_t b, bool withAlgorithm);

    void remove(std::size_t a, std::size_t b, bool byIds, bool hasDispatcher);

    void removeOf(std::size_t a);

    void clean(std::size_t a, bool hasDispatcher);

    void cleanPair(std::size_t a, std::size_t b);

    void find(std::size_t a, std::size_t b);

    void sort();

    void setLinked(bool isLinked) { m_cache.setLinked(isLinked); }
    void reserve(std::size_t count) { m_cache.reserve(m_pairs.size() + count); }

    /// @param goes whether a pair, by the number of its addition, is to be removed
    void process(bool isOrdered, const std::function<bool(std::uint64_t)>& goes);

    void addMany(const std::vector<std::pair<std::size_t, std::size_t>>& rows);

    void removeMany(const std::vector<std::pair<std::size_t, std::size_t>>& rows);

    /// Not from within callbacks.
    void check();

private:
    struct Entry
    {
        std::uint64_t serial;  ///< number of the addition
        FakeDispatcher::Algorithm* algorithm;
        bool hasInfo;    ///< m_internalInfo1 is the serial
        bool isRenewed;  ///< the algorithm is not the pair's first
    };

    /// An addition through addOverlappingPair().
    struct Frame
    {
        Ids ids;
        Frame* outer;
        bool isPassed;
        bool isCancelled;
        bool isFiltering = false;
        bool isWanted = false;  ///< the ghost callback shall get it
    };

    /// The ghost callback's part of an addition.
    struct Report
    {
        Ids ids;
        Report* outer;
        bool isCancelled;
    };

    struct Pass
    {
        bool isOrdered;
        Pass* outer;
        std::set<Ids> before;
        std::set<std::uint64_t> visited;
        std::uint64_t current;
        std::uint64_t lastBefore;
        bool maySkip;
    };

    struct Removing
    {
        Removing(PairCacheTwin& twin, bool hasDispatcher)
            : dispatcher(hasDispatcher ? &twin.m_dispatcher : nullptr),
              m_twin(twin),
              m_before(twin.m_isRemoving)
        {
            twin.m_isRemoving = true;
            ++twin.m_removingCalls;
        }
        ~Removing() { m_twin.m_isRemoving = m_before; }
        btDispatcher* dispatcher;

    private:
        PairCacheTwin& m_twin;
        bool m_before;
    };

    class Filter final : public btOverlapFilterCallback
    {
    public:
        explicit Filter(PairCacheTwin& twin) : m_twin(twin) {}
        bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
        {
            return m_twin.filter(a, b);
        }

    private:
        PairCacheTwin& m_twin;
    };

    static std::uint32_t bits(int id) { return static_cast<std::uint32_t>(id); }
    static Ids idsOfProxies(const btBroadphaseProxy* a, const btBroadphaseProxy* b);
    static bool passesWords(const btBroadphaseProxy* a, const btBroadphaseProxy* b);
    static bool isDescending(const std::vector<Ids>& list);

    bool wanted(const Frame& frame) const;
    bool isBeingReported(Ids ids) const;
    /// Whether the filter or the ghost callback of the pair is running.
    bool isBeingAdded(Ids ids) const;

    bool filter(const btBroadphaseProxy* a, const btBroadphaseProxy* b);

    template <class IsAffected>
    void cancelFilters(IsAffected isAffected)
    {
        for (Frame* frame = m_frame; frame != nullptr; frame = frame->outer)
            frame->isCancelled |= frame->isFiltering && isAffected(frame->ids);
    }

    void ghostAdds(Ids ids);

    void ghostRemoves(Ids ids);

    bool visitPair(Pass& pass, const btBroadphasePair& pair, const std::function<bool(std::uint64_t)>& goes);

    void checkSkipped(const Pass& pass);

    void insert(Ids ids) { m_pairs[ids] = {++m_serial, nullptr, false, false}; }

    std::uint64_t serialOf(Ids ids) const;

    void erase(Ids ids);

    static void mark(btBroadphasePair& pair, Entry& entry);

    void giveAlgorithm(btBroadphasePair& pair, Entry& entry);

    void require(bool holds, const char* fault, Ids ids);

    Proxies& m_proxies;
    const bool m_hasGhosts;
    FakeDispatcher m_dispatcher;
    GhostLog m_ghosts;
    Filter m_filter{*this};
    PairCache m_cache;
    std::map<Ids, Entry> m_pairs;
    std::set<Ids> m_reported;  ///< to the ghost callback
    std::set<FakeDispatcher::Algorithm*> m_leaked;
    Frame* m_frame = nullptr;
    Report* m_reports = nullptr;
    Pass* m_passes = nullptr;
    bool m_isRemoving = false;
    bool m_additionsCancelled = false;
    bool m_hasAlgorithmToLose = false;
    std::uint64_t m_serial = 0;
    std::uint64_t m_removingCalls = 0;
    std::string m_fault;
};
}  // namespace cullet::test
