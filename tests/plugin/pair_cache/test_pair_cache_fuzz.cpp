// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/tests/plugin/pair_cache/pair_cache_support.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

namespace cullet::test
{
namespace
{
/// A pair cache and a std::map that must agree with it after any sequence of operations.
class Twins
{
public:
    Twins(std::uint32_t seed, std::size_t proxyCount, bool withGhosts) : m_random(seed)
    {
        for (std::size_t i = 0; i < proxyCount; ++i)
            m_live.push_back(m_proxies.add(++m_lastId));
        m_ghosts.onAdd = [this](btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1) {
            EXPECT_TRUE(m_ghostPairs.insert({proxy0->m_uniqueId, proxy1->m_uniqueId}).second);
        };
        m_ghosts.onRemove = [this](btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1) {
            EXPECT_EQ(m_ghostPairs.erase({proxy0->m_uniqueId, proxy1->m_uniqueId}), 1u);
        };
        if (withGhosts)
            m_cache.setInternalGhostPairCallback(&m_ghosts);
        m_hasGhosts = withGhosts;
    }

    ~Twins()
    {
        for (btBroadphaseProxy* proxy : m_live)
            m_cache.removeOverlappingPairsContainingProxy(proxy, &m_dispatcher);
        EXPECT_EQ(m_cache.getNumOverlappingPairs(), 0);
        EXPECT_EQ(m_cache.stats().proxies, 0u);
        EXPECT_EQ(m_dispatcher.freedCount, m_dispatcher.madeCount);
        EXPECT_EQ(m_dispatcher.destroyedCount, m_dispatcher.madeCount);
        EXPECT_TRUE(m_ghostPairs.empty());
    }

    void step()
    {
        if (m_steps % 3000 == 2999)
            m_cache.setLinked(!m_cache.isLinked());
        const std::uint32_t dice = m_random.below(100000);
        // Adding prevails for a while, then removing, so that the cache fills and empties.
        const std::uint32_t addLimit = m_steps++ / 20000 % 2 == 0 ? 60000 : 35000;
        if (dice < addLimit)
            add();
        else if (dice < 85000)
            remove();
        else if (dice < 97000)
            find();
        else if (dice < 97500)
            replaceProxy();
        else if (dice < 99000)
            cleanProxy();
        else if (dice < 99900)
            changeInBulk();
        else
            pass();
    }

    void check()
    {
        ASSERT_TRUE(m_cache.isConsistent());
        ASSERT_EQ(static_cast<std::size_t>(m_cache.getNumOverlappingPairs()), m_model.size());
        for (int i = 0; i < m_cache.getNumOverlappingPairs(); ++i)
        {
            const btBroadphasePair& pair = m_cache.getOverlappingPairArray()[i];
            const auto known = m_model.find(idsOf(pair));
            ASSERT_NE(known, m_model.end());
            ASSERT_EQ(pair.m_algorithm, known->second);
        }
        if (m_hasGhosts)
        {
            ASSERT_EQ(m_ghostPairs.size(), m_model.size());
        }
        ASSERT_EQ(m_ghosts.forbiddenCalls, 0);
        m_largest = std::max(m_largest, m_model.size());
    }

    const PairCache& cache() const { return m_cache; }

    std::size_t m_largest = 0;
    std::map<std::string, std::size_t> m_counts;

private:
    btBroadphaseProxy* anyProxy()
    {
        return m_live[m_random.below(static_cast<std::uint32_t>(m_live.size()))];
    }

    ProxyPair anyPair()
    {
        ProxyPair pair{anyProxy(), anyProxy()};
        while (pair.first == pair.second)
            pair.second = anyProxy();
        return pair;
    }

    static RowPair idsOfProxies(ProxyPair pair)
    {
        return std::minmax(pair.first->m_uniqueId, pair.second->m_uniqueId);
    }

    /// An existing pair, as often as possible; always of two live proxies.
    ProxyPair probablyKnownPair()
    {
        const int count = m_cache.getNumOverlappingPairs();
        if (count == 0 || m_random.chance(0.2f))
            return anyPair();
        const auto index = m_random.below(static_cast<std::uint32_t>(count));
        const btBroadphasePair& pair = m_cache.getOverlappingPairArray()[static_cast<int>(index)];
        return m_random.chance(0.5f) ? ProxyPair{pair.m_pProxy0, pair.m_pProxy1}
                                     : ProxyPair{pair.m_pProxy1, pair.m_pProxy0};
    }

    void add()
    {
        const ProxyPair proxies = anyPair();
        btBroadphasePair* pair = m_cache.addOverlappingPair(proxies.first, proxies.second);
        ASSERT_NE(pair, nullptr);
        ASSERT_EQ(idsOf(*pair), idsOfProxies(proxies));
        const auto [known, isNew] = m_model.insert({idsOfProxies(proxies), nullptr});
        ASSERT_EQ(pair->m_algorithm, known->second);
        ++m_counts[isNew ? "added" : "added again"];
        if (isNew && m_random.chance(0.5f))
            known->second = pair->m_algorithm = m_dispatcher.makeAlgorithm();
    }

    void remove()
    {
        const ProxyPair proxies = probablyKnownPair();
        const RowPair ids = idsOfProxies(proxies);
        const int before = m_cache.getNumOverlappingPairs();
        if (m_random.chance(0.5f))
            m_cache.removeOverlappingPair(proxies.first, proxies.second, &m_dispatcher);
        else
            m_cache.removePair(toPair(ids), &m_dispatcher);
        const std::size_t removed = m_model.erase(ids);
        ASSERT_EQ(before - m_cache.getNumOverlappingPairs(), static_cast<int>(removed));
        ++m_counts[removed == 1 ? "removed" : "removed none"];
    }

    void find()
    {
        const ProxyPair proxies = probablyKnownPair();
        const auto known = m_model.find(idsOfProxies(proxies));
        const btBroadphasePair* pair = m_cache.findPair(proxies.first, proxies.second);
        ASSERT_EQ(pair != nullptr, known != m_model.end());
        ASSERT_EQ(m_cache.findPair(toPair(idsOfProxies(proxies))), pair);
        if (pair != nullptr)
        {
            ASSERT_EQ(idsOf(*pair), known->first);
            ASSERT_EQ(pair->m_algorithm, known->second);
        }
        ++m_counts[pair != nullptr ? "found" : "found none"];
    }

    /// Replaces a proxy by another one with a larger id, which may be much larger.
    void replaceProxy()
    {
        const std::uint32_t slot = m_random.below(static_cast<std::uint32_t>(m_live.size()));
        const int id = m_live[slot]->m_uniqueId;
        m_cache.removeOverlappingPairsContainingProxy(m_live[slot], &m_dispatcher);
        for (auto known = m_model.begin(); known != m_model.end();)
        {
            const bool goes = known->first.first == id || known->first.second == id;
            m_counts["removed with a proxy"] += goes;
            known = goes ? m_model.erase(known) : std::next(known);
        }
        m_lastId += m_random.chance(0.1f) ? 1 + static_cast<int>(m_random.below(1 << 20)) : 1;
        m_live[slot]->m_uniqueId = m_lastId;
    }

    void cleanProxy()
    {
        btBroadphaseProxy* proxy = anyProxy();
        m_cache.cleanProxyFromPairs(proxy, &m_dispatcher);
        for (auto& [ids, algorithm] : m_model)
        {
            if (ids.first != proxy->m_uniqueId && ids.second != proxy->m_uniqueId)
                continue;
            m_counts["cleaned"] += algorithm != nullptr;
            algorithm = nullptr;
        }
    }

    void changeInBulk()
    {
        Pairs removed;
        std::vector<ProxyPair> added;
        for (int i = 0; i < 40; ++i)
        {
            removed.push_back(toPair(idsOfProxies(probablyKnownPair())));
            added.push_back(anyPair());
        }
        std::sort(removed.begin(), removed.end());
        std::size_t count = 0;
        for (const Pair ids : removed)
            count += m_model.erase({static_cast<int>(ids.first), static_cast<int>(ids.second)});
        ASSERT_EQ(m_cache.removePairs(removed.data(), removed.size(), &m_dispatcher), count);
        for (const ProxyPair& pair : added)
        {
            const bool isNew = m_model.insert({idsOfProxies(pair), nullptr}).second;
            const int before = m_cache.getNumOverlappingPairs();
            ASSERT_NE(m_cache.addPairUnfiltered(pair.first, pair.second), nullptr);
            ASSERT_EQ(m_cache.getNumOverlappingPairs(), before + isNew);
            m_counts["bulk"] += isNew;
        }
    }

    void pass()
    {
        if (m_random.chance(0.2f))
        {
            m_cache.sortOverlappingPairs(&m_dispatcher);
            const std::vector<RowPair> ids = test::idsOf(m_cache);
            ASSERT_TRUE(std::is_sorted(ids.rbegin(), ids.rend()));
            ++m_counts["sorted"];
            return;
        }
        btDispatcherInfo info;
        info.m_deterministicOverlappingPairs = m_random.chance(0.5f);
        const float probability = m_random.chance(0.1f) ? 0.9f : 0.02f;
        std::vector<RowPair> removed;
        Visit visit(
            [&](btBroadphasePair& pair)
            {
                const bool goes = m_random.chance(probability);
                if (goes)
                    removed.push_back(test::idsOf(pair));
                return goes;
            });
        m_cache.processAllOverlappingPairs(&visit, &m_dispatcher, info);
        ASSERT_EQ(visit.visited.size(), m_model.size()) << "each once";
        if (info.m_deterministicOverlappingPairs)
        {
            ASSERT_TRUE(std::is_sorted(visit.visited.rbegin(), visit.visited.rend()));
        }
        std::sort(visit.visited.begin(), visit.visited.end());
        ASSERT_TRUE(std::equal(visit.visited.begin(), visit.visited.end(), m_model.begin(),
                               [](const RowPair& ids, const auto& known) { return ids == known.first; }));
        for (const RowPair& ids : removed)
            m_model.erase(ids);
        m_counts["removed in a pass"] += removed.size();
    }

    static Pair toPair(RowPair ids)
    {
        return {static_cast<std::uint32_t>(ids.first), static_cast<std::uint32_t>(ids.second)};
    }

    Random m_random;
    PairCache m_cache;
    FakeDispatcher m_dispatcher;
    GhostLog m_ghosts;
    Proxies m_proxies;
    std::vector<btBroadphaseProxy*> m_live;
    std::map<RowPair, btCollisionAlgorithm*> m_model;
    std::set<RowPair> m_ghostPairs;
    int m_lastId = 0;
    std::size_t m_steps = 0;
    bool m_hasGhosts = false;
};

class PairCacheFuzz : public testing::TestWithParam<std::tuple<std::uint32_t, std::size_t, bool>>
{
};

TEST_P(PairCacheFuzz, AgreesWithAMap)
{
    const auto [seed, proxyCount, withGhosts] = GetParam();
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Twins twins(seed, proxyCount, withGhosts);
    for (int batch = 0; batch < 500; ++batch)
    {
        for (int i = 0; i < 200; ++i)
            twins.step();
        twins.check();
        if (HasFatalFailure())
            return;
    }
    for (const char* kind : {"added", "added again", "removed", "removed none", "found", "found none",
                             "cleaned", "removed with a proxy", "removed in a pass", "bulk", "sorted"})
        EXPECT_GT(twins.m_counts[kind], 5u) << kind;
    EXPECT_GT(twins.m_largest, 100u);
}

INSTANTIATE_TEST_SUITE_P(Seeds, PairCacheFuzz,
                         testing::Values(std::make_tuple(1u, 20u, true), std::make_tuple(2u, 60u, false),
                                         std::make_tuple(3u, 150u, true), std::make_tuple(4u, 400u, false)));

TEST(PairCache, GivesTheSameArrayForTheSameOperations)
{
    Twins a(7, 80, true);
    Twins b(7, 80, false);
    for (int i = 0; i < 20000; ++i)
    {
        a.step();
        b.step();
    }
    EXPECT_EQ(idsOf(a.cache()), idsOf(b.cache()));
    EXPECT_GT(idsOf(a.cache()).size(), 100u);
}
}  // namespace
}  // namespace cullet::test
