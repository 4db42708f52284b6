// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A cache that has no lists of the pairs of each proxy, and scans all pairs for them.
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/tests/plugin/pair_cache/pair_cache_support.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace cullet::test
{
namespace
{
/// Twelve proxies and all pairs of them, each with an algorithm.
class UnlinkedPairs : public testing::Test
{
protected:
    static constexpr int kProxies = 12, kPairs = kProxies * (kProxies - 1) / 2;

    void SetUp() override
    {
        addAllPairs(m_cache, m_proxies, kProxies);
        for (int i = 0; i < kPairs; ++i)
            m_cache.getOverlappingPairArray()[i].m_algorithm = m_dispatcher.makeAlgorithm();
        m_cache.setLinked(false);
        ASSERT_FALSE(m_cache.isLinked());
    }
    void TearDown() override
    {
        EXPECT_TRUE(m_cache.isConsistent());
        for (std::size_t i = 0; i < kProxies; ++i)
            m_cache.removeOverlappingPairsContainingProxy(m_proxies[i], &m_dispatcher);
        EXPECT_EQ(m_cache.getNumOverlappingPairs(), 0);
        EXPECT_EQ(m_dispatcher.freedCount, m_dispatcher.madeCount);
    }

    std::ptrdiff_t pairsOf(int id) const
    {
        const std::vector<RowPair> ids = idsOf(m_cache);
        return std::count_if(ids.begin(), ids.end(),
                             [id](const RowPair& pair) { return pair.first == id || pair.second == id; });
    }

    /// What the destruction of the pair's algorithm does.
    void onDestroy(std::size_t a, std::size_t b, const std::function<void()>& function)
    {
        btBroadphasePair* const pair = m_cache.findPair(m_proxies[a], m_proxies[b]);
        static_cast<FakeDispatcher::Algorithm*>(pair->m_algorithm)->onDestroy = function;
    }

    Proxies m_proxies{kProxies};
    FakeDispatcher m_dispatcher;
    PairCache m_cache;
};

TEST_F(UnlinkedPairs, AreRemovedAndCleanedByProxy)
{
    m_cache.cleanProxyFromPairs(m_proxies[3], &m_dispatcher);
    EXPECT_EQ(m_dispatcher.freedCount, kProxies - 1);
    EXPECT_EQ(m_cache.getNumOverlappingPairs(), kPairs);
    m_cache.removeOverlappingPairsContainingProxy(m_proxies[4], &m_dispatcher);
    EXPECT_EQ(m_cache.getNumOverlappingPairs(), kPairs - kProxies + 1);
    EXPECT_EQ(pairsOf(5), 0);
    EXPECT_EQ(m_dispatcher.freedCount, 2 * (kProxies - 1) - 1);
}

TEST_F(UnlinkedPairs, AreAllRemovedWhenDestructorsRemoveOthersBeforeThem)
{
    // The last pairs move to places that the scan has passed.
    onDestroy(4, 8, [this] { m_cache.removeOverlappingPair(m_proxies[10], m_proxies[11], &m_dispatcher); });
    onDestroy(4, 11, [this] { m_cache.addOverlappingPair(m_proxies[4], m_proxies[11]); });
    onDestroy(1, 4, [this] { m_cache.removeOverlappingPairsContainingProxy(m_proxies[4], &m_dispatcher); });
    m_cache.removeOverlappingPairsContainingProxy(m_proxies[4], &m_dispatcher);
    EXPECT_EQ(pairsOf(5), 0);
    EXPECT_EQ(m_cache.getNumOverlappingPairs(), kPairs - kProxies);
}

TEST_F(UnlinkedPairs, AreAllCleanedWhenDestructorMovesOne)
{
    onDestroy(2, 3, [this] { m_cache.removeOverlappingPair(m_proxies[0], m_proxies[1], &m_dispatcher); });
    m_cache.cleanProxyFromPairs(m_proxies[2], &m_dispatcher);
    for (std::size_t i = 0; i < kProxies; ++i)
    {
        if (i != 2)
        {
            EXPECT_EQ(m_cache.findPair(m_proxies[2], m_proxies[i])->m_algorithm, nullptr) << i;
        }
    }
}

TEST_F(UnlinkedPairs, AreReportedOnceEachWhenGhostCallbackRemovesTheRest)
{
    GhostLog ghosts;
    m_cache.setInternalGhostPairCallback(&ghosts);
    ghosts.onRemove = [&](btBroadphaseProxy*, btBroadphaseProxy*)
    { m_cache.removeOverlappingPairsContainingProxy(m_proxies[7], &m_dispatcher); };
    m_cache.removeOverlappingPairsContainingProxy(m_proxies[7], &m_dispatcher);
    m_cache.setInternalGhostPairCallback(nullptr);
    EXPECT_EQ(pairsOf(8), 0);
    std::sort(ghosts.removed.begin(), ghosts.removed.end());
    EXPECT_EQ(std::adjacent_find(ghosts.removed.begin(), ghosts.removed.end()), ghosts.removed.end());
    EXPECT_EQ(ghosts.removed.size(), std::size_t{kProxies - 1});
}

TEST_F(UnlinkedPairs, StayUnlinkedWhileCallbackRunsAndAreLinkedAfterwards)
{
    bool isCalled = false;
    GhostLog ghosts;
    m_cache.setInternalGhostPairCallback(&ghosts);
    ghosts.onRemove = [&](btBroadphaseProxy*, btBroadphaseProxy*)
    {
        isCalled = true;
        m_cache.setLinked(true);
        EXPECT_FALSE(m_cache.isLinked());
    };
    m_cache.removeOverlappingPair(m_proxies[0], m_proxies[1], &m_dispatcher);
    m_cache.setInternalGhostPairCallback(nullptr);
    EXPECT_TRUE(isCalled);
    m_cache.setLinked(true);
    EXPECT_TRUE(m_cache.isLinked());
    EXPECT_EQ(m_cache.stats().proxies, std::uint64_t{kProxies});
    EXPECT_TRUE(m_cache.isConsistent());
}

TEST_F(UnlinkedPairs, TakeSixteenBytesLessEach)
{
    m_cache.reserve(10000);
    const std::uint64_t unlinked = m_cache.bytes();
    m_cache.setLinked(true);
    EXPECT_GE(m_cache.bytes(), unlinked + 16u * 10000);
    m_cache.setLinked(false);
    EXPECT_EQ(m_cache.bytes(), unlinked);
}
}  // namespace
}  // namespace cullet::test
