// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A pair cache on its own, for which memory or a callback fails once: it stays consistent, and has the pairs of a model.
#include "cullet/tests/faults/support/sweep.h"
#include "cullet/tests/plugin/pair_cache/pair_cache_support.h"

#include <algorithm>
#include <memory>
#include <set>

namespace cullet::test
{
namespace
{
/// Reports of pairs, balanced unless a report throws.
class FaultyReports final : public btOverlappingPairCallback
{
public:
    btBroadphasePair* addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) override
    {
        {
            const FaultPause pause;
            known.insert({a->m_uniqueId, b->m_uniqueId});
        }
        failInCallback();
        return nullptr;
    }
    void* removeOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b, btDispatcher*) override
    {
        known.erase({a->m_uniqueId, b->m_uniqueId});
        failInCallback();
        return nullptr;
    }
    void removeOverlappingPairsContainingProxy(btBroadphaseProxy*, btDispatcher*) override {}

    std::set<RowPair> known;
};

class CacheLife
{
public:
    CacheLife(FaultRun& run, bool hasReports) : m_run(run), m_proxies(0), m_hasReports(hasReports)
    {
        // On separate pages of ids.
        for (int i = 0; i < 24; ++i)
            m_proxies.add(1 + 700 * i);
        if (hasReports)
            m_cache.setInternalGhostPairCallback(&m_reports);
    }

    void live()
    {
        addAll(0, 12);
        pass({});
        removeAllOf(3);
        addAll(6, 24);
        pass(deterministic());
        m_cache.setLinked(false);
        removeAllOf(5);
        for (std::size_t i = 0; i < 20; i += 2)
            remove(i, i + 1);
        // Without memory the pairs stay unlinked.
        m_cache.setLinked(true);
        EXPECT_TRUE(m_cache.isLinked() || hasFaultHappened());
        m_run.attempt([&] { m_cache.sortOverlappingPairs(nullptr); });
        expectModel();
        addAll(0, 24);
        removeMost();
        for (std::size_t i = 0; i < m_proxies.size(); ++i)
            removeAllOf(i);
        EXPECT_EQ(m_cache.getNumOverlappingPairs(), 0);
    }

private:
    void addAll(std::size_t begin, std::size_t end)
    {
        for (std::size_t b = begin; b < end; ++b)
            for (std::size_t a = begin; a < b; ++a)
                m_run.attempt([&] { m_cache.addOverlappingPair(m_proxies[a], m_proxies[b]); });
        expectModel();
        // Null from an addition without memory; with it the pair comes.
        for (std::size_t b = begin; b < end; ++b)
            for (std::size_t a = begin; a < b; ++a)
                m_run.insist([&] { m_cache.addOverlappingPair(m_proxies[a], m_proxies[b]); });
        expectModel();
        for (std::size_t b = begin; b < end; ++b)
            for (std::size_t a = begin; a < b; ++a)
            {
                EXPECT_NE(m_cache.findPair(m_proxies[a], m_proxies[b]), nullptr);
            }
    }

    void remove(std::size_t a, std::size_t b)
    {
        m_run.insist([&] { m_cache.removeOverlappingPair(m_proxies[a], m_proxies[b], nullptr); });
        EXPECT_EQ(m_cache.findPair(m_proxies[a], m_proxies[b]), nullptr);
        expectModel();
    }

    void removeAllOf(std::size_t i)
    {
        m_run.insist([&] { m_cache.removeOverlappingPairsContainingProxy(m_proxies[i], nullptr); });
        expectModel();
    }

    /// Removes all but each tenth pair in a batch.
    void removeMost()
    {
        Pairs most;
        std::size_t staying = 0;
        {
            const FaultPause pause;
            for (const RowPair& pair : idsOf(m_cache))
            {
                const bool isStaying = (pair.first + pair.second) % 10 == 0;
                staying += isStaying ? 1u : 0u;
                if (!isStaying)
                    most.push_back(makePair(static_cast<std::uint32_t>(pair.first),
                                            static_cast<std::uint32_t>(pair.second)));
            }
            std::sort(most.begin(), most.end());
        }
        EXPECT_GT(most.size(), 2 * staying);
        m_run.insist([&] { m_cache.removePairs(most.data(), most.size(), nullptr); });
        EXPECT_EQ(static_cast<std::size_t>(m_cache.getNumOverlappingPairs()), staying);
        expectModel();
    }

    /// Removes each seventh pair.
    void pass(const btDispatcherInfo& info)
    {
        struct Visitor final : btOverlapCallback
        {
            bool processOverlap(btBroadphasePair&) override
            {
                failInCallback();
                return ++count % 7 == 0;
            }
            int count = 0;
        } visitor;
        m_run.attempt([&] { m_cache.processAllOverlappingPairs(&visitor, nullptr, info); });
        EXPECT_GT(visitor.count, hasFaultHappened() ? -1 : 50);
        expectModel();
    }

    void expectModel()
    {
        const FaultPause pause;
        EXPECT_TRUE(m_cache.isConsistent());
        if (!m_hasReports)
            return;
        const auto ids = idsOf(m_cache);
        EXPECT_EQ(m_reports.known, std::set<RowPair>(ids.begin(), ids.end()));
    }

    FaultRun& m_run;
    Proxies m_proxies;
    const bool m_hasReports;
    FaultyReports m_reports;
    PairCache m_cache;
};

std::uint64_t sweepCache(const char* name, FaultKind kind, bool hasReports)
{
    const auto live = [&](FaultRun& run)
    {
        for (int life = 0; life < 2; ++life)
            CacheLife(run, hasReports).live();
    };
    const std::uint64_t every = kind == FaultKind::Callback ? kEveryOfFew : kEveryOfMost;
    return sweepFaults(name, kind, live, every).injected;
}

TEST(PairCacheFaults, LeaveTheCacheConsistentWhenAllocationFails)
{
    EXPECT_GE(sweepCache("pair cache", FaultKind::New, false), 70u);
    EXPECT_GE(sweepCache("pair cache with reports", FaultKind::New, true), 70u);
    EXPECT_GE(sweepCache("pair cache", FaultKind::BulletAllocation, false), 5u);
}

TEST(PairCacheFaults, LeaveTheCacheConsistentWhenCallbackThrows)
{
    EXPECT_GE(sweepCache("pair cache", FaultKind::Callback, false), 60u);
    EXPECT_GE(sweepCache("pair cache with reports", FaultKind::Callback, true), 80u);
}
}  // namespace
}  // namespace cullet::test
