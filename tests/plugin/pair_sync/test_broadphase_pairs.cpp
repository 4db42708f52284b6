// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace cullet::test
{
namespace
{
/// Sets Bullet's global margin for a scope.
class MarginScope
{
public:
    explicit MarginScope(double margin) : m_old(gDbvtMargin) { gDbvtMargin = btScalar(margin); }
    ~MarginScope() { gDbvtMargin = m_old; }
    MarginScope(const MarginScope&) = delete;
    MarginScope& operator=(const MarginScope&) = delete;

private:
    btScalar m_old;
};

TEST(BroadphasePairs, AreCountedInTheBytesOfTheStatistics)
{
    Broadphase broadphase(bruteOptions());
    constexpr std::uint64_t kBoxes = 300, kPairs = kBoxes * (kBoxes - 1) / 2;
    for (std::uint64_t i = 0; i < kBoxes; ++i)
        addCube(broadphase, vec(0, 0, 0));
    const std::uint64_t before = broadphase.stats().bytes;
    broadphase.calculateOverlappingPairs(nullptr);
    ASSERT_EQ(broadphase.stats().pairs, kPairs);
    EXPECT_GE(broadphase.stats().bytes, before + kPairs * sizeof(Pair));
}

TEST(BroadphasePairs, IncludeTouchingPointAndIdenticalBoxes)
{
    Broadphase broadphase(bruteOptions());
    const btVector3 zero = vec(0, 0, 0);
    const btVector3 one = vec(1, 1, 1);
    const auto add = [&](const btVector3& min, const btVector3& max)
    { return broadphase.createProxy(min, max, 0, nullptr, 1, kAllGroups, nullptr); };
    add(zero, one);                   // 1
    add(one, vec(2, 2, 2));           // 2 shares a corner with 1
    add(one, one);                    // 3 is the corner
    add(zero, one);                   // 4 is 1 again
    add(vec(9, 9, 9), vec(9, 9, 9));  // 5, 6: the same point
    add(vec(9, 9, 9), vec(9, 9, 9));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}, {1, 3}, {1, 4}, {2, 3}, {2, 4}, {3, 4}, {5, 6}}));
}

TEST(BroadphasePairs, ExcludeBoxesWithSmallestGap)
{
    Broadphase broadphase(bruteOptions());
    const btScalar next = std::nextafter(btScalar(1), btScalar(2));
    broadphase.createProxy(vec(0, 0, 0), vec(1, 1, 1), 0, nullptr, 1, kAllGroups, nullptr);
    broadphase.createProxy(btVector3(next, 0, 0), vec(2, 1, 1), 0, nullptr, 1, kAllGroups, nullptr);
    // In a double build the float boxes of the two overlap; the exact ones decide.
    EXPECT_EQ(updatedPairs(broadphase), Pairs{});
}

TEST(BroadphasePairs, BeginOnlyOnExactTouchOfDoubleBoxesWithinFloatRounding)
{
    Broadphase broadphase(bruteOptions());
    const double gap = 1e-12;
    broadphase.createProxy(vec(0, 0, 0), vec(1, 1, 1), 0, nullptr, 1, kAllGroups, nullptr);
    btBroadphaseProxy* other =
        broadphase.createProxy(vec(1 + gap, 0, 0), vec(2, 1, 1), 0, nullptr, 1, kAllGroups, nullptr);
    const bool isDouble = sizeof(btScalar) == 8;
    EXPECT_EQ(updatedPairs(broadphase).size(), isDouble ? 0u : 1u);
    broadphase.setAabb(other, vec(1, 0, 0), vec(2, 1, 1), nullptr);
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
    broadphase.setAabb(other, vec(1 + gap, 0, 0), vec(2, 1, 1), nullptr);
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u) << "within the margin a pair stays";
    EXPECT_EQ(broadphase.stats().pendingPairs, 0u);
}

TEST(BroadphasePairs, PersistWithinMarginAndEndBeyondIt)
{
    Broadphase broadphase(bruteOptions());
    btBroadphaseProxy* a = addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* b = addCube(broadphase, vec(1, 0, 0));
    EXPECT_TRUE(hasPair(broadphase, a, b) == false && updatedPairs(broadphase).size() == 1);
    moveCube(broadphase, b, vec(1.09, 0, 0));  // both boxes grow by 0.05
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
    moveCube(broadphase, b, vec(1.11, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
    moveCube(broadphase, b, vec(1.09, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u) << "a pair enters on exact overlap only";
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
}

TEST(BroadphasePairs, FollowZeroDbvtMarginFromNextUpdate)
{
    Broadphase broadphase(bruteOptions());
    addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* b = addCube(broadphase, vec(1, 0, 0));
    ASSERT_EQ(updatedPairs(broadphase).size(), 1u);
    const MarginScope margin(0);
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
    moveCube(broadphase, b, vec(1.001, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
}

TEST(BroadphasePairs, PreferMarginOfOptionsOverBulletsGlobal)
{
    BroadphaseOptions options = bruteOptions();
    options.margin = btScalar(0.5);
    Broadphase broadphase(options);
    addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* b = addCube(broadphase, vec(1, 0, 0));
    ASSERT_EQ(updatedPairs(broadphase).size(), 1u);
    moveCube(broadphase, b, vec(1.99, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
    moveCube(broadphase, b, vec(2.01, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
}

TEST(BroadphasePairs, EndInOneUpdateWhenBodiesAreTeleported)
{
    // DBVT still has 80 % of them two updates later, and keeps them permanently if no body moves.
    Broadphase broadphase(bruteOptions());
    std::vector<btBroadphaseProxy*> proxies;
    for (int i = 0; i < 400; ++i)
        proxies.push_back(addCube(broadphase, vec(0.9 * i, 0, 0)));
    ASSERT_EQ(updatedPairs(broadphase).size(), 399u);
    for (std::size_t i = 0; i < proxies.size(); i += 2)
        moveCube(broadphase, proxies[i], vec(0.9 * double(i), 100, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
}

TEST(BroadphasePairs, HaveLowerIdFirstWhenProxyMemoryIsReused)
{
    Broadphase broadphase(bruteOptions());
    btBroadphaseProxy* first = addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* second = addCube(broadphase, vec(0, 0, 0));
    ASSERT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
    broadphase.destroyProxy(first, nullptr);
    broadphase.calculateOverlappingPairs(nullptr);
    btBroadphaseProxy* third = addCube(broadphase, vec(0, 0, 0));
    EXPECT_EQ(third, first) << "the place of the first body, so that the test means something";
    ASSERT_EQ(updatedPairs(broadphase), (Pairs{{2, 3}}));
    const btBroadphasePair& pair = broadphase.getOverlappingPairCache()->getOverlappingPairArray()[0];
    EXPECT_EQ(pair.m_pProxy0, second);
    EXPECT_EQ(pair.m_pProxy1, third);
}

TEST(BroadphasePairs, EnterCacheInOrderOfIds)
{
    Broadphase broadphase(bruteOptions());
    std::vector<btBroadphaseProxy*> proxies;
    for (int i = 0; i < 30; ++i)
        proxies.push_back(addCube(broadphase, vec(((i * 7) % 30) * 0.4, 0, 0)));
    broadphase.calculateOverlappingPairs(nullptr);
    const btBroadphasePairArray& array = broadphase.getOverlappingPairCache()->getOverlappingPairArray();
    ASSERT_GT(array.size(), 29);
    for (int i = 1; i < array.size(); ++i)
    {
        const Pair before = {idOf(array[i - 1].m_pProxy0), idOf(array[i - 1].m_pProxy1)};
        const Pair after = {idOf(array[i].m_pProxy0), idOf(array[i].m_pProxy1)};
        EXPECT_LT(before, after);
    }
}

TEST(BroadphasePairs, FollowLastOfSeveralSetAabbCallsBetweenUpdates)
{
    Broadphase broadphase(bruteOptions());
    addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* b = addCube(broadphase, vec(5, 0, 0));
    for (const double x : {0.0, 7.0, 0.5, 9.0})
        moveCube(broadphase, b, vec(x, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
    for (const double x : {0.0, 7.0, 0.5})
        moveCube(broadphase, b, vec(x, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
    // Moving away and back between two updates is no change.
    moveCube(broadphase, b, vec(50, 0, 0));
    moveCube(broadphase, b, vec(0.5, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
}

TEST(BroadphasePairs, StayCorrectWhenUpdatesAreRepeatedOrSkipped)
{
    Broadphase broadphase(bruteOptions());
    addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* b = addCube(broadphase, vec(0.5, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
    for (int frame = 0; frame < 10; ++frame)
        moveCube(broadphase, b, vec(frame, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
}

TEST(BroadphasePairs, PersistAndBeginForBodiesThatAreNotSetAgain)
{
    // setForceUpdateAllAabbs(false): static and sleeping bodies are never set.
    Broadphase broadphase(bruteOptions());
    btBroadphaseProxy* still = addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* stillToo = addCube(broadphase, vec(0.5, 0, 0));
    btBroadphaseProxy* mover = addCube(broadphase, vec(50, 0, 0));
    for (int frame = 0; frame < 10; ++frame)
        EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
    moveCube(broadphase, mover, vec(-0.9, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_TRUE(hasPair(broadphase, still, mover));
    EXPECT_FALSE(hasPair(broadphase, stillToo, mover));
    // A sleeping body wakes, after many frames without setAabb(), on top of a static one.
    moveCube(broadphase, stillToo, vec(-0.5, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_TRUE(hasPair(broadphase, stillToo, mover));
}

TEST(BroadphasePairs, AcceptNullDispatcherEverywhere)
{
    Broadphase broadphase(bruteOptions());
    btBroadphaseProxy* a =
        broadphase.createProxy(vec(0, 0, 0), vec(1, 1, 1), 0, nullptr, 1, kAllGroups, nullptr);
    btBroadphaseProxy* b =
        broadphase.createProxy(vec(0, 0, 0), vec(1, 1, 1), 0, nullptr, 1, kAllGroups, nullptr);
    broadphase.calculateOverlappingPairs(nullptr);
    broadphase.setAabb(a, vec(5, 5, 5), vec(6, 6, 6), nullptr);
    broadphase.calculateOverlappingPairs(nullptr);
    broadphase.destroyProxy(a, nullptr);
    broadphase.destroyProxy(b, nullptr);
    broadphase.resetPool(nullptr);
    EXPECT_EQ(broadphase.stats().bodies, 0u);
}

TEST(BroadphasePairs, IgnoreClientObjectsWithoutGhostCallback)
{
    Broadphase broadphase(bruteOptions());
    // Invalid addresses: reading them would crash.
    auto* nonsense = reinterpret_cast<void*>(std::uintptr_t{1});
    addCube(broadphase, vec(0, 0, 0), 0.5, 1, kAllGroups, nonsense);
    btBroadphaseProxy* b = addCube(broadphase, vec(0.5, 0, 0), 0.5, 1, kAllGroups, nonsense);
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
    moveCube(broadphase, b, vec(0.4, 0, 0));
    EXPECT_EQ(rayHits(broadphase, vec(-9, 0, 0), vec(9, 0, 0)), (Ids{1, 2}));
    broadphase.destroyProxy(b, nullptr);
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
}

TEST(BroadphasePairs, IgnoreClientObjectsWhenGhostPairsAreNotImmediate)
{
    struct Counting final : btOverlappingPairCallback
    {
        btBroadphasePair* addOverlappingPair(btBroadphaseProxy*, btBroadphaseProxy*) override
        {
            ++added;
            return nullptr;
        }
        void* removeOverlappingPair(btBroadphaseProxy*, btBroadphaseProxy*, btDispatcher*) override
        {
            --added;
            return nullptr;
        }
        void removeOverlappingPairsContainingProxy(btBroadphaseProxy*, btDispatcher*) override {}
        int added = 0;
    } callback;
    Broadphase broadphase(bruteOptions());
    broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&callback);
    broadphase.setGhostPairsImmediate(false);
    auto* nonsense = reinterpret_cast<void*>(std::uintptr_t{1});
    addCube(broadphase, vec(0, 0, 0), 0.5, 1, kAllGroups, nonsense);
    btBroadphaseProxy* b = addCube(broadphase, vec(0.5, 0, 0), 0.5, 1, kAllGroups, nonsense);
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
    EXPECT_EQ(callback.added, 1);
    moveCube(broadphase, b, vec(9, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
    EXPECT_EQ(callback.added, 0);
}
}  // namespace
}  // namespace cullet::test
