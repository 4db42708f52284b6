// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/log.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/plugin/pair_sync/pair_sync.h"
#include "cullet/plugin/proxies/proxy_store.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <set>
#include <vector>

namespace cullet::test
{
namespace
{
TEST(Broadphase, ReturnsItsOwnPairCacheFromBothGetters)
{
    Broadphase broadphase(bruteOptions());
    const btBroadphaseInterface& asConst = broadphase;
    EXPECT_NE(broadphase.getOverlappingPairCache(), nullptr);
    EXPECT_EQ(asConst.getOverlappingPairCache(), broadphase.getOverlappingPairCache());
    EXPECT_FALSE(broadphase.getOverlappingPairCache()->hasDeferredRemoval());
}

TEST(Broadphase, StoresProxyDataAtOnce)
{
    Broadphase broadphase(bruteOptions());
    int client = 0;
    btBroadphaseProxy* proxy =
        broadphase.createProxy(vec(-1, -2, -3), vec(1, 2, 3), 8, &client, 4, 6, nullptr);
    EXPECT_EQ(proxy->m_clientObject, &client);
    EXPECT_EQ(proxy->m_collisionFilterGroup, 4);
    EXPECT_EQ(proxy->m_collisionFilterMask, 6);
    EXPECT_EQ(proxy->m_uniqueId, 1);
    EXPECT_EQ(proxy->m_aabbMin, vec(-1, -2, -3));
    EXPECT_EQ(proxy->m_aabbMax, vec(1, 2, 3));
    broadphase.setAabb(proxy, vec(0.1, 0.2, 0.3), vec(1.1, 1.2, 1.3), nullptr);
    EXPECT_EQ(proxy->m_aabbMin, vec(0.1, 0.2, 0.3));
    EXPECT_EQ(proxy->m_aabbMax, vec(1.1, 1.2, 1.3));
}

TEST(Broadphase, ReturnsExactlyTheAabbThatWasSet)
{
    Broadphase broadphase(bruteOptions());
    btBroadphaseProxy* proxy = addCube(broadphase, vec(0, 0, 0));
    Random random(7);
    for (int i = 0; i < 1000; ++i)
    {
        // Thirds are not floats: a double build must not round them.
        const auto point = random.point(-9, 9);
        const btVector3 min = vec(point[0] / 3.0, point[1] / 3.0, point[2] / 3.0);
        const btVector3 max = min + vec(random.unit() / 3.0, 0, 1e-3);
        broadphase.setAabb(proxy, min, max, nullptr);
        btVector3 gotMin;
        btVector3 gotMax;
        broadphase.getAabb(proxy, gotMin, gotMax);
        ASSERT_EQ(gotMin, min);
        ASSERT_EQ(gotMax, max);
    }
}

TEST(Broadphase, DoesNotMoveProxiesInMemory)
{
    Broadphase broadphase(bruteOptions());
    std::map<btBroadphaseProxy*, int> idOfAddress;
    Random random(11);
    for (int i = 0; i < 20000; ++i)
    {
        btBroadphaseProxy* proxy = addCube(broadphase, vec(3.0 * i, 0, 0));
        ASSERT_TRUE(idOfAddress.emplace(proxy, proxy->m_uniqueId).second)
            << "the address of a living proxy again";
        if (random.chance(0.3f))
        {
            auto victim = idOfAddress.lower_bound(proxy - random.below(4000));
            if (victim == idOfAddress.end())
                victim = idOfAddress.begin();
            broadphase.destroyProxy(victim->first, nullptr);
            idOfAddress.erase(victim);
        }
    }
    for (const auto& [proxy, id] : idOfAddress)
        EXPECT_EQ(proxy->m_uniqueId, id);
    EXPECT_EQ(broadphase.stats().bodies, idOfAddress.size());
}

TEST(Broadphase, PlacesEachFloatProxyInItsOwnCacheLine)
{
    Broadphase broadphase(bruteOptions());
    std::vector<btBroadphaseProxy*> proxies;
    for (int i = 0; i < 3000; ++i)
        proxies.push_back(addCube(broadphase, vec(3.0 * i, 0, 0)));
    std::set<std::uintptr_t> lines;
    for (const btBroadphaseProxy* proxy : proxies)
        lines.insert(reinterpret_cast<std::uintptr_t>(proxy) / 64);
    if (sizeof(btScalar) == 4)
    {
        EXPECT_EQ(lines.size(), proxies.size());
    }
    for (const btBroadphaseProxy* proxy : proxies)
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(proxy) % 32, 0u);
}

TEST(Broadphase, CountsUniqueIdsUpFromOneWithoutReuse)
{
    Broadphase broadphase(bruteOptions());
    for (int expected = 1; expected <= 3000; ++expected)
    {
        btBroadphaseProxy* proxy = addCube(broadphase, vec(0, 3.0 * expected, 0));
        ASSERT_EQ(proxy->m_uniqueId, expected);
        if (expected % 3 == 0)
            broadphase.destroyProxy(proxy, nullptr);
        if (expected % 100 == 0)
            broadphase.calculateOverlappingPairs(nullptr);
    }
}

TEST(Broadphase, RestartsIdsInResetPoolOnlyWhenEmpty)
{
    Broadphase broadphase(bruteOptions());
    btBroadphaseProxy* a = addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* b = addCube(broadphase, vec(0, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    broadphase.resetPool(nullptr);
    EXPECT_EQ(pairsOf(broadphase), (Pairs{{1, 2}})) << "a world with bodies is left alone";
    btBroadphaseProxy* c = addCube(broadphase, vec(9, 0, 0));
    EXPECT_EQ(c->m_uniqueId, 3);
    for (btBroadphaseProxy* proxy : {a, b, c})
        broadphase.destroyProxy(proxy, nullptr);
    broadphase.resetPool(nullptr);
    btBroadphaseProxy* d = addCube(broadphase, vec(0, 0, 0));
    EXPECT_EQ(d->m_uniqueId, 1);
    btBroadphaseProxy* e = addCube(broadphase, vec(0, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
    EXPECT_EQ(boxHits(broadphase, vec(-9, -9, -9), vec(9, 9, 9)), (Ids{1, 2}));
    broadphase.destroyProxy(d, nullptr);
    broadphase.destroyProxy(e, nullptr);
}

TEST(Broadphase, GivesNewProxyItsOwnPairsAfterDestroyInSameStep)
{
    Broadphase broadphase(bruteOptions());
    btBroadphaseProxy* a = addCube(broadphase, vec(0, 0, 0));
    addCube(broadphase, vec(0.5, 0, 0));
    addCube(broadphase, vec(10, 0, 0));
    ASSERT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
    broadphase.destroyProxy(a, nullptr);
    addCube(broadphase, vec(10.5, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{3, 4}}));
    addCube(broadphase, vec(0.5, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{2, 5}, {3, 4}}));
}

TEST(Broadphase, DestroysJustCreatedOrJustMovedProxyWithItsPairs)
{
    Broadphase broadphase(bruteOptions());
    btBroadphaseProxy* stays = addCube(broadphase, vec(0, 0, 0));
    broadphase.destroyProxy(addCube(broadphase, vec(0, 0, 0)), nullptr);
    EXPECT_EQ(updatedPairs(broadphase), Pairs{});

    btBroadphaseProxy* moved = addCube(broadphase, vec(0, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
    moveCube(broadphase, moved, vec(0.1, 0, 0));
    broadphase.destroyProxy(moved, nullptr);
    EXPECT_EQ(pairsOf(broadphase), Pairs{}) << "pairs go before the proxy, not in the next update";
    EXPECT_EQ(updatedPairs(broadphase), Pairs{});
    broadphase.destroyProxy(stays, nullptr);
    EXPECT_EQ(updatedPairs(broadphase), Pairs{});
}

TEST(Broadphase, KeepsDestroyedProxyIntactDuringPairCallbacks)
{
    struct Ghosts final : btOverlappingPairCallback
    {
        btBroadphasePair* addOverlappingPair(btBroadphaseProxy*, btBroadphaseProxy*) override
        {
            return nullptr;
        }
        void* removeOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b, btDispatcher*) override
        {
            EXPECT_EQ(a->m_uniqueId, 1);
            EXPECT_EQ(b->m_uniqueId, 2);
            EXPECT_EQ(a->m_aabbMin, vec(-0.5, -0.5, -0.5));
            EXPECT_EQ(a->m_collisionFilterGroup, 16);
            ++removedCount;
            return nullptr;
        }
        void removeOverlappingPairsContainingProxy(btBroadphaseProxy*, btDispatcher*) override
        {
            ADD_FAILURE();
        }
        int removedCount = 0;
    } ghosts;
    Broadphase broadphase(bruteOptions());
    broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&ghosts);
    btBroadphaseProxy* a = addCube(broadphase, vec(0, 0, 0), 0.5, 16);
    addCube(broadphase, vec(0, 0, 0));
    ASSERT_EQ(updatedPairs(broadphase).size(), 1u);
    broadphase.destroyProxy(a, nullptr);
    EXPECT_EQ(ghosts.removedCount, 1);
}

TEST(Broadphase, FindsNoPairsWithoutBodiesOrWithOne)
{
    Broadphase broadphase(bruteOptions());
    EXPECT_EQ(updatedPairs(broadphase), Pairs{});
    btBroadphaseProxy* only = addCube(broadphase, vec(0, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), Pairs{});
    broadphase.destroyProxy(only, nullptr);
    EXPECT_EQ(updatedPairs(broadphase), Pairs{});
    EXPECT_EQ(boxHits(broadphase, vec(-9, -9, -9), vec(9, 9, 9)), Ids{});
    EXPECT_EQ(rayHits(broadphase, vec(-9, 0, 0), vec(9, 0, 0)), Ids{});
}

TEST(Broadphase, AllowsDeletionWithLivingProxies)
{
    auto broadphase = std::make_unique<Broadphase>(bruteOptions());
    for (int i = 0; i < 5000; ++i)
        addCube(*broadphase, vec(0.3 * i, 0, 0));
    EXPECT_GT(updatedPairs(*broadphase).size(), 5000u);
    broadphase.reset();
}

TEST(Broadphase, AllowsDestructionAfterMain)
{
    // A crash in its destructor would change the exit status of this program.
    static Broadphase last(
        []
        {
            BroadphaseOptions options;
            options.threads = 2;
            return options;
        }());
    for (int i = 0; i < 5000; ++i)
        addCube(last, vec(0.9 * i, 0, 0));
    EXPECT_EQ(updatedPairs(last).size(), 4999u);
    EXPECT_EQ(boxHits(last, vec(-1, -1, -1), vec(0, 1, 1)), (Ids{1}));
}

TEST(Broadphase, SharesNoStateWithOtherBroadphases)
{
    Broadphase one(bruteOptions());
    Broadphase other(bruteOptions());
    addCube(one, vec(0, 0, 0));
    btBroadphaseProxy* first = addCube(other, vec(0, 0, 0));
    addCube(other, vec(0.5, 0, 0));
    EXPECT_EQ(first->m_uniqueId, 1);
    EXPECT_EQ(updatedPairs(one), Pairs{});
    EXPECT_EQ(updatedPairs(other), (Pairs{{1, 2}}));
}

TEST(Broadphase, ReportsUnionOfBoxesAsBoundsAndZeroWhenEmpty)
{
    Broadphase broadphase(bruteOptions());
    btVector3 min = vec(7, 7, 7);
    btVector3 max = vec(8, 8, 8);
    broadphase.getBroadphaseAabb(min, max);
    EXPECT_EQ(min, vec(0, 0, 0));
    EXPECT_EQ(max, vec(0, 0, 0));
    btBroadphaseProxy* left = addCube(broadphase, vec(-5, 0, 0));
    addCube(broadphase, vec(5, 2, 0), 1.0);
    broadphase.getBroadphaseAabb(min, max);
    EXPECT_EQ(min, vec(-5.5, -0.5, -1));
    EXPECT_EQ(max, vec(6, 3, 1));
    broadphase.destroyProxy(left, nullptr);
    broadphase.getBroadphaseAabb(min, max);
    EXPECT_EQ(min, vec(4, 1, -1));
}

TEST(Broadphase, PrintsStatsAsOneLogLineAndNothingToStderr)
{
    static int lineCount = 0;
    lineCount = 0;
    setLogFunction(
        [](LogLevel level, const char* message)
        {
            EXPECT_EQ(level, LogLevel::Info);
            EXPECT_NE(std::string(message).find("1 bodies"), std::string::npos) << message;
            ++lineCount;
        });
    Broadphase broadphase(bruteOptions());
    addCube(broadphase, vec(0, 0, 0));
    broadphase.printStats();
    EXPECT_EQ(lineCount, 1);
    setLogFunction(nullptr);
    testing::internal::CaptureStderr();
    broadphase.printStats();
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(PairSync, TracksPairsOfIdsBeyondSignedRange)
{
    for (const std::uint32_t first : {0x7ffffffdu, 0xfffffffdu})
    {
        ProxyStore store(first);
        const QueryIndex index(store.table());
        PairSync pairSync(store, nullptr, makeBruteForceBackend(), bruteOptions());
        std::vector<Proxy*> cubes;
        for (int i = 0; i < 6; ++i)
            cubes.push_back(
                store.create(vec(0.1 * i, 0, 0), vec(0.1 * i + 1, 1, 1), nullptr, {1, kAllGroups}));
        pairSync.update(0.05f, index, nullptr);
        EXPECT_EQ(pairSync.adapter().count(), 15);
        // The application removes a pair: the backend restarts from the other pairs.
        pairSync.adapter().cache()->removeOverlappingPair(cubes[0], cubes[1], nullptr);
        pairSync.update(0.05f, index, nullptr);
        EXPECT_EQ(pairSync.adapter().count(), 14);
        BroadphaseStats stats;
        pairSync.addTo(stats);
        EXPECT_EQ(stats.pendingPairs, 1u);
        for (int i = 0; i < 6; ++i)
            store.setBox(cubes[static_cast<std::size_t>(i)], vec(9 * i, 0, 0), vec(9 * i + 1, 1, 1));
        pairSync.addImmediately(*cubes[0], *cubes[5]);
        pairSync.update(0.05f, index, nullptr);
        EXPECT_EQ(pairSync.adapter().count(), 0) << first;
        // Pairs appear at once, and are removed with the boxes.
        store.setBox(cubes[5], vec(0, 0, 0), vec(1, 1, 1));
        pairSync.addImmediately(*cubes[5], *cubes[0]);
        EXPECT_EQ(pairSync.adapter().count(), 1);
        pairSync.update(0.05f, index, nullptr);
        EXPECT_EQ(pairSync.adapter().count(), 1);
        store.setBox(cubes[5], vec(0, 9, 0), vec(1, 10, 1));
        pairSync.update(0.05f, index, nullptr);
        EXPECT_EQ(pairSync.adapter().count(), 0);
    }
}

TEST(PairSync, PassesProxiesToFilterAndGhostsInOrderOfIdsAsInt)
{
    struct Order final : btOverlapFilterCallback, btOverlappingPairCallback
    {
        bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
        {
            EXPECT_LT(a->m_uniqueId, b->m_uniqueId);
            ++filtered;
            return true;
        }
        btBroadphasePair* addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) override
        {
            EXPECT_LT(a->m_uniqueId, b->m_uniqueId);
            ++added;
            return nullptr;
        }
        void* removeOverlappingPair(btBroadphaseProxy*, btBroadphaseProxy*, btDispatcher*) override
        {
            return nullptr;
        }
        void removeOverlappingPairsContainingProxy(btBroadphaseProxy*, btDispatcher*) override {}
        mutable int filtered = 0;
        int added = 0;
    };
    btHashedOverlappingPairCache hashed;
    btSortedOverlappingPairCache sorted;
    for (btOverlappingPairCache* cache :
         {static_cast<btOverlappingPairCache*>(nullptr), static_cast<btOverlappingPairCache*>(&hashed),
          static_cast<btOverlappingPairCache*>(&sorted)})
    {
        Order order;
        ProxyStore store(0x7ffffffeu);
        const QueryIndex index(store.table());
        PairSync pairSync(store, cache, makeBruteForceBackend(), bruteOptions());
        btOverlappingPairCache& used = *pairSync.adapter().cache();
        used.setOverlapFilterCallback(&order);
        used.setInternalGhostPairCallback(&order);
        for (int i = 0; i < 4; ++i)
            store.create(vec(0, 0, 0), vec(1, 1, 1), nullptr, {1, kAllGroups});
        pairSync.update(0.05f, index, nullptr);
        EXPECT_EQ(pairSync.adapter().count(), 6);
        EXPECT_GE(order.filtered, 6);
        EXPECT_EQ(order.added, 6);
        used.setInternalGhostPairCallback(nullptr);
        used.setOverlapFilterCallback(nullptr);
    }
}

/// Defines nextIdOf(). An explicit instantiation may name a private member, which 2^32 proxies would count up.
template <std::uint32_t ProxyStore::*kMember>
struct NextIdOfStore
{
    friend std::uint32_t& nextIdOf(ProxyStore& store) { return store.*kMember; }
};
std::uint32_t& nextIdOf(ProxyStore& store);
template struct NextIdOfStore<&ProxyStore::m_nextUniqueId>;

TEST(ProxyStore, RestartsIdsAtOneAfterLargestId)
{
    ProxyStore store(0xffffffffu);
    const auto make = [&] { return store.create(vec(0, 0, 0), vec(1, 1, 1), nullptr, {1, kAllGroups}); };
    EXPECT_EQ(idOf(make()), 0xffffffffu);
    for (std::uint32_t id = 1; id < 5; ++id)
        EXPECT_EQ(idOf(make()), id) << "0 is no id";
}

TEST(ProxyStore, SkipsIdsOfLiveProxiesAfterRestart)
{
    ProxyStore store;
    const auto make = [&] { return store.create(vec(0, 0, 0), vec(1, 1, 1), nullptr, {1, kAllGroups}); };
    std::vector<Proxy*> old;
    for (std::uint32_t id = 1; id <= 7; ++id)
    {
        old.push_back(make());
        ASSERT_EQ(idOf(old.back()), id);
    }
    nextIdOf(store) = 0xfffffffeu;
    EXPECT_EQ(idOf(make()), 0xfffffffeu);
    Proxy* const largest = make();
    EXPECT_EQ(idOf(largest), 0xffffffffu);
    // Ids of 4 and 6 are free; the row of 6 is not yet.
    store.destroy(old[3]);
    store.endUpdate();
    store.destroy(old[5]);
    for (const std::uint32_t id : {4u, 6u, 8u, 9u})
    {
        Proxy* const born = make();
        EXPECT_EQ(idOf(born), id);
        EXPECT_EQ(store.find(id), born);
    }
    for (const std::uint32_t id : {1u, 2u, 3u, 5u, 7u})
        EXPECT_EQ(store.find(id), old[id - 1]);
    EXPECT_EQ(store.find(0xffffffffu), largest);
    EXPECT_EQ(store.find(0), nullptr);
    int liveCount = 0;
    store.forEach([&](const Proxy*, std::uint32_t) { ++liveCount; });
    EXPECT_EQ(liveCount, 11);
}

TEST(ProxyPool, KeepsAddressesAndRowsWhileItGrowsByChunksAndBlocks)
{
    // Three blocks: the first one of chunks by themselves.
    constexpr auto kChunks = static_cast<std::uint32_t>(2 * ProxyPool::kChunksPerBlock + 2);
    constexpr std::uint32_t kRows = kChunks * ProxyPool::kProxiesPerChunk + 1;
    ProxyPool pool;
    for (int round = 0; round < 2; ++round)
    {
        std::vector<const Proxy*> proxies;
        for (std::uint32_t row = 0; row < kRows; ++row)
        {
            proxies.push_back(pool.make(row));
            pool.at(row)->m_uniqueId = static_cast<int>(row + 7);
        }
        for (std::uint32_t row = 0; row < kRows; ++row)
        {
            ASSERT_EQ(pool.at(row), proxies[row]);
            ASSERT_EQ(ProxyPool::rowOf(proxies[row]), row);
            ASSERT_EQ(proxies[row]->m_uniqueId, static_cast<int>(row + 7));
        }
        constexpr std::size_t kBytesOfBlock = ProxyPool::kChunksPerBlock * ProxyPool::kChunkBytes;
        EXPECT_GE(pool.bytes(), 3 * kBytesOfBlock);
        EXPECT_LE(pool.bytes(), 3 * kBytesOfBlock + 2 * kChunks * sizeof(void*) + 64);
        pool.clear();
    }
}
}  // namespace
}  // namespace cullet::test
