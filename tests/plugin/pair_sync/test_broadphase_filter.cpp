// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/backends.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
/// A filter that counts its calls, checks its arguments, and answers by a rule.
struct CountingFilter final : btOverlapFilterCallback
{
    using Rule = std::function<bool(const btBroadphaseProxy&, const btBroadphaseProxy&)>;
    explicit CountingFilter(Rule answer) : rule(std::move(answer)) {}
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
    {
        ++askedCount;
        EXPECT_EQ(std::this_thread::get_id(), thread);
        EXPECT_NE(a, b);
        EXPECT_GT(a->m_uniqueId, 0);
        EXPECT_GT(b->m_uniqueId, 0);
        return rule(*a, *b);
    }
    Rule rule;
    std::thread::id thread = std::this_thread::get_id();
    mutable int askedCount = 0;
};

const auto kYes = [](const btBroadphaseProxy&, const btBroadphaseProxy&) { return true; };
const auto kNo = [](const btBroadphaseProxy&, const btBroadphaseProxy&) { return false; };

TEST(BroadphaseFilter, RequiresBothMasksToAgreeWithoutCallback)
{
    Broadphase broadphase(bruteOptions());
    addCube(broadphase, vec(0, 0, 0), 0.5, 1, 2);
    addCube(broadphase, vec(0, 0, 0), 0.5, 2, 1);
    addCube(broadphase, vec(0, 0, 0), 0.5, 2, 4);
    addCube(broadphase, vec(0, 0, 0), 0.5, 1, kAllGroups);
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}, {2, 4}}));
}

TEST(BroadphaseFilter, IgnoresMasksWhenCallbackIsSet)
{
    Broadphase broadphase(bruteOptions());
    CountingFilter filter(kYes);
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
    addCube(broadphase, vec(0, 0, 0), 0.5, 0, 0);
    addCube(broadphase, vec(0, 0, 0), 0.5, 0, 0);
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
    EXPECT_EQ(filter.askedCount, 1);
}

TEST(BroadphaseFilter, CallsCallbackOnlyForPairsAboutToBeAdded)
{
    Broadphase broadphase(bruteOptions());
    CountingFilter filter(kYes);
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
    std::vector<btBroadphaseProxy*> proxies;
    for (int i = 0; i < 20; ++i)
        proxies.push_back(addCube(broadphase, vec(0.9 * i, 0, 0)));
    EXPECT_EQ(filter.askedCount, 0) << "bodies that are not ghosts pair in the update";
    ASSERT_EQ(updatedPairs(broadphase).size(), 19u);
    EXPECT_EQ(filter.askedCount, 19);
    for (int step = 0; step < 10; ++step)
    {
        for (int i = 0; i < 20; ++i)
            moveCube(broadphase, proxies[std::size_t(i)], vec(0.9 * i, 0.01 * step, 0));
        broadphase.calculateOverlappingPairs(nullptr);
    }
    EXPECT_EQ(filter.askedCount, 19);
}

TEST(BroadphaseFilter, ReevaluatesRefusedPairOnlyWhenBoxLeavesItsSkin)
{
    const auto run = [](btBroadphaseInterface& broadphase)
    {
        CountingFilter filter(kNo);
        broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
        addCube(broadphase, vec(0, 0, 0));
        btBroadphaseProxy* mover = addCube(broadphase, vec(0.5, 0, 0));
        std::vector<int> asked;
        broadphase.calculateOverlappingPairs(nullptr);
        asked.push_back(filter.askedCount);
        for (const double x : {0.51, 0.53, 0.7, 0.71, 0.72})
        {
            moveCube(broadphase, mover, vec(x, 0, 0));
            broadphase.calculateOverlappingPairs(nullptr);
            asked.push_back(filter.askedCount);
        }
        broadphase.getOverlappingPairCache()->setOverlapFilterCallback(nullptr);
        return asked;
    };
    Broadphase ours(bruteOptions());
    EXPECT_EQ(run(ours), (std::vector<int>{1, 1, 1, 2, 2, 2}));
    EXPECT_EQ(ours.stats().pendingPairs, 1u);
    // DBVT starts with a leaf that is not enlarged, so that it calls the filter once more at the first move.
    StockBroadphase stock;
    const std::vector<int> stockAsked = run(stock);
    EXPECT_EQ(stockAsked.back(), 3);
}

TEST(BroadphaseFilter, ReevaluatesRefusedPairWhenBoxLeavesItsSkinThoughAnotherWasRefusedMeanwhile)
{
    BroadphaseOptions options = bruteOptions();
    options.margin = 1;
    Broadphase broadphase(options);
    CountingFilter filter(kNo);
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
    addCube(broadphase, vec(0, 0, 0), 5);
    btBroadphaseProxy* mover = addCube(broadphase, vec(5, 0, 0));
    btBroadphaseProxy* late = addCube(broadphase, vec(50, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(filter.askedCount, 1);
    moveCube(broadphase, mover, vec(5, 0.75, 0));
    moveCube(broadphase, late, vec(5.75, 0.75, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(filter.askedCount, 2) << "the pair of both cubes that moved";
    moveCube(broadphase, mover, vec(5, 1.625, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(filter.askedCount, 4) << "both pairs of the cube that has moved by more than the margin";
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(nullptr);
}

TEST(BroadphaseFilter, DoesNotReevaluateRefusedPairWhileNothingMoves)
{
    Broadphase broadphase(bruteOptions());
    CountingFilter filter(kNo);
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
    for (int i = 0; i < 50; ++i)
        addCube(broadphase, vec(0, 0, 0));
    for (int step = 0; step < 10; ++step)
        EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
    EXPECT_EQ(filter.askedCount, 50 * 49 / 2);
}

TEST(BroadphaseFilter, KeepsExistingPairsAfterMaskEditsUntilBoxesSeparate)
{
    Broadphase broadphase(bruteOptions());
    addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* mover = addCube(broadphase, vec(0.5, 0, 0));
    ASSERT_EQ(updatedPairs(broadphase).size(), 1u);
    mover->m_collisionFilterMask = 0;
    for (int i = 0; i < 10; ++i)
    {
        moveCube(broadphase, mover, vec(0.5 + 0.01 * i, 0, 0));
        EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
    }
    moveCube(broadphase, mover, vec(5, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
    moveCube(broadphase, mover, vec(0.5, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
}

TEST(BroadphaseFilter, HasPairsOfNewMaskWhenPlannerRemovesThoseOfTheOld)
{
    for (const int others : {2, 1500})
    {
        Broadphase broadphase;
        auto* link = addCube(broadphase, vec(0, 0, 0));
        auto* obstacle = addCube(broadphase, vec(0.5, 0, 0));
        for (int i = 0; i < others; ++i)
            addCube(broadphase, vec(0, 10 + 3 * i, 0));
        for (int round = 0; round < 12; ++round)
        {
            link->m_collisionFilterMask = 0;
            broadphase.getOverlappingPairCache()->removeOverlappingPairsContainingProxy(link, nullptr);
            moveCube(broadphase, link, vec(0, 0, 0));
            for (int update = 0; update < 2; ++update)
            {
                broadphase.calculateOverlappingPairs(nullptr);
                EXPECT_FALSE(hasPair(broadphase, link, obstacle)) << others << ", " << round;
            }
            link->m_collisionFilterMask = kAllGroups;
            moveCube(broadphase, link, vec(0, 0, 0));
            broadphase.calculateOverlappingPairs(nullptr);
            EXPECT_TRUE(hasPair(broadphase, link, obstacle)) << others << ", " << round;
        }
    }
}

TEST(BroadphaseFilter, KeepsPairsOfOldMaskAsDbvtWhenPlannerCleansThem)
{
    const auto run = [](btBroadphaseInterface& broadphase)
    {
        auto* link = addCube(broadphase, vec(0, 0, 0));
        auto* obstacle = addCube(broadphase, vec(0.5, 0, 0));
        std::vector<bool> seen;
        const auto look = [&](double x)
        {
            moveCube(broadphase, link, vec(x, 0, 0));
            // Twice: DBVT tests a part of its pairs in each call.
            broadphase.calculateOverlappingPairs(nullptr);
            broadphase.calculateOverlappingPairs(nullptr);
            seen.push_back(hasPair(broadphase, link, obstacle));
        };
        look(0);
        link->m_collisionFilterMask = 0;
        broadphase.getOverlappingPairCache()->cleanProxyFromPairs(link, nullptr);
        for (const double x : {0.0, 0.01, 9.0, 0.0})
            look(x);
        link->m_collisionFilterMask = kAllGroups;
        for (const double x : {9.0, 0.0})
            look(x);
        return seen;
    };
    Broadphase ours(bruteOptions());
    StockBroadphase stock;
    const std::vector<bool> expected = {true, true, true, false, false, false, true};
    EXPECT_EQ(run(ours), expected);
    EXPECT_EQ(run(stock), expected);
}

TEST(BroadphaseFilter, AppliesNewlyEnabledMaskInNextUpdate)
{
    Broadphase broadphase(bruteOptions());
    addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* other = addCube(broadphase, vec(0.5, 0, 0), 0.5, 1, 0);
    ASSERT_EQ(updatedPairs(broadphase).size(), 0u);
    other->m_collisionFilterMask = kAllGroups;
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u) << "without any setAabb";
}

TEST(BroadphaseFilter, AppliesMaskEditOfUnmovedBodyToApproachingBody)
{
    // Filter words are written directly into the proxy; the body gets no setAabb (sleeping, no forced updates).
    Broadphase broadphase(bruteOptions());
    btBroadphaseProxy* silent = addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* mover = addCube(broadphase, vec(5, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    silent->m_collisionFilterMask = 0;
    moveCube(broadphase, mover, vec(0.5, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 0u);
    silent->m_collisionFilterMask = kAllGroups;
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
}

TEST(BroadphaseFilter, NoticesMaskEditInSetAabbOfUnchangedBoxInLargeWorld)
{
    // The sweep over silent bodies takes several updates in a world of this size; setAabb must not wait for it.
    Broadphase broadphase(bruteOptions());
    for (int i = 0; i < 12000; ++i)
        addCube(broadphase, vec(3.0 * i, 0, 0), 0.5, 1, 1);
    btBroadphaseProxy* last = addCube(broadphase, vec(0.5, 0, 0), 0.5, 1, 0);
    broadphase.calculateOverlappingPairs(nullptr);
    last->m_collisionFilterMask = 1;
    moveCube(broadphase, last, vec(0.5, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase).size(), 1u);
}

TEST(BroadphaseFilter, NoticesMaskEditsWithoutBoxesInNextUpdateOfSmallWorldAndWithinFourOfLargerOne)
{
    struct Case
    {
        int bodies, updates;
    };
    for (const Case& one : {Case{256, 1}, Case{1030, 4}, Case{16384, 4}})
    {
        BroadphaseOptions options = bruteOptions();
        options.backend = BackendChoice::Grid;
        Broadphase broadphase(options);
        std::vector<btBroadphaseProxy*> cubes;
        for (int i = 0; i < one.bodies; ++i)
            cubes.push_back(addCube(broadphase, vec(2 * (i / 2), 0, 0), 0.5, 1, 0));
        ASSERT_EQ(updatedPairs(broadphase), Pairs{});
        for (btBroadphaseProxy* cube : cubes)
            cube->m_collisionFilterMask = 1;
        for (int update = 1; update < one.updates; ++update)
            broadphase.calculateOverlappingPairs(nullptr);
        EXPECT_EQ(updatedPairs(broadphase).size(), std::size_t(one.bodies) / 2) << one.bodies << " bodies";
    }
}

TEST(BroadphaseFilter, AppliesCallbackSetAtAnyTimeInNextUpdate)
{
    Broadphase broadphase(bruteOptions());
    btOverlappingPairCache* cache = broadphase.getOverlappingPairCache();
    addCube(broadphase, vec(0, 0, 0), 0.5, 1, 1);
    addCube(broadphase, vec(0.5, 0, 0), 0.5, 1, 1);
    btBroadphaseProxy* masked = addCube(broadphase, vec(0.2, 0, 0), 0.5, 2, 2);
    ASSERT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
    CountingFilter no(kNo);
    cache->setOverlapFilterCallback(&no);
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}})) << "pairs that exist stay";
    EXPECT_EQ(no.askedCount, 2) << "the masks kept 1-3 and 2-3 out, which a callback may let in";
    CountingFilter yes(kYes);
    cache->setOverlapFilterCallback(&yes);
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}, {1, 3}, {2, 3}}));
    cache->setOverlapFilterCallback(nullptr);
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}, {1, 3}, {2, 3}}));
    moveCube(broadphase, masked, vec(9, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    moveCube(broadphase, masked, vec(0.2, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}})) << "the masks decide again";
}

TEST(BroadphaseFilter, FindsRestingPairsOfOtherMasksWhenACallbackTakesOver)
{
    GridOptions rows;
    rows.flatLimit = 0;
    std::unique_ptr<Backend> all[] = {makeBruteForceBackend(), makeGridBackend(), makeGridBackend(rows),
                                      makeSapBackend(), makeLeGrandBackend()};
    for (std::unique_ptr<Backend>& backend : all)
    {
        Broadphase broadphase(std::move(backend));
        CountingFilter filter(kYes);
        for (int i = 0; i < 40; ++i)
            addCube(broadphase, vec(0.9 * i, 0, 0), 0.5, 1 + i % 2, 1 + i % 2);
        for (int update = 0; update < 10; ++update)
            EXPECT_EQ(updatedPairs(broadphase), Pairs{}) << "neighbours have other masks";
        broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
        EXPECT_EQ(updatedPairs(broadphase).size(), 39u) << broadphase.stats().backendName;
    }
}

TEST(BroadphaseFilter, PassesNoDestroyedProxyToCallback)
{
    Broadphase broadphase(bruteOptions());
    CountingFilter filter(
        [](const btBroadphaseProxy& a, const btBroadphaseProxy& b)
        {
            EXPECT_NE(a.m_uniqueId, 2);
            EXPECT_NE(b.m_uniqueId, 2);
            return false;
        });
    addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* doomed = addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* mover = addCube(broadphase, vec(0, 0, 0));
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
    broadphase.destroyProxy(doomed, nullptr);
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(filter.askedCount, 1);
    moveCube(broadphase, mover, vec(0.4, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(filter.askedCount, 2);
}

TEST(BroadphaseFilter, AllowsCallbackToCreateMoveAndDestroyProxiesAndNestUpdates)
{
    Broadphase broadphase(bruteOptions());
    btBroadphaseProxy* victim = nullptr;
    btBroadphaseProxy* coming = nullptr;
    btBroadphaseProxy* leaving = nullptr;
    std::vector<btBroadphaseProxy*> born;
    CountingFilter filter(
        [&](const btBroadphaseProxy&, const btBroadphaseProxy&)
        {
            if (victim != nullptr)
                broadphase.destroyProxy(victim, nullptr);
            victim = nullptr;
            if (coming != nullptr)
                moveCube(broadphase, coming, vec(0, 0, 0));
            coming = nullptr;
            if (leaving != nullptr)
                moveCube(broadphase, leaving, vec(-50, 0, 0));
            leaving = nullptr;
            if (born.size() < 3)
                born.push_back(addCube(broadphase, vec(100 + 0.1 * double(born.size()), 0, 0)));
            broadphase.calculateOverlappingPairs(nullptr);  // nested: no effect
            return true;
        });
    btBroadphaseProxy* const first = addCube(broadphase, vec(0, 0, 0));
    for (int i = 0; i < 4; ++i)
        victim = addCube(broadphase, vec(0, 0, 0));
    coming = addCube(broadphase, vec(50, 0, 0));
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}, {1, 3}, {1, 4}, {2, 3}, {2, 4}, {3, 4}}));
    // The next update finds what the callbacks of the first have created and moved; the first cube leaves during it.
    leaving = first;
    const Pairs pairs = updatedPairs(broadphase);
    ASSERT_EQ(leaving, nullptr);
    for (const Pair pair : Pairs{{2, 6}, {3, 6}, {4, 6}, {7, 8}, {7, 9}, {8, 9}})
        EXPECT_TRUE(std::binary_search(pairs.begin(), pairs.end(), pair)) << pair.first << "-" << pair.second;
    EXPECT_EQ(updatedPairs(broadphase),
              (Pairs{{2, 3}, {2, 4}, {2, 6}, {3, 4}, {3, 6}, {4, 6}, {7, 8}, {7, 9}, {8, 9}}));
    EXPECT_EQ(broadphase.stats().pendingPairs, 0u);
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(nullptr);
}

TEST(BroadphaseFilter, AllowsCallbackToDestroyMoreProxiesThanQuarantineHolds)
{
    Broadphase broadphase(bruteOptions());
    addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* mover = addCube(broadphase, vec(0.5, 0, 0));
    std::vector<btBroadphaseProxy*> crowd;
    for (int i = 0; i < 3000; ++i)
        crowd.push_back(addCube(broadphase, vec(10 + 3 * i, 0, 0)));
    CountingFilter filter(
        [&](const btBroadphaseProxy&, const btBroadphaseProxy&)
        {
            for (btBroadphaseProxy* proxy : crowd)
                broadphase.destroyProxy(proxy, nullptr);
            crowd.clear();
            // This move must not be lost although the change marks of the rows above are skipped.
            moveCube(broadphase, mover, vec(20, 0, 0));
            return true;
        });
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
    broadphase.calculateOverlappingPairs(nullptr);
    addCube(broadphase, vec(20, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{2, 3003}}));
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(nullptr);
}

TEST(BroadphaseFilter, ForgetsRefusedPairsWhenTheirBoxesSeparate)
{
    Broadphase broadphase(bruteOptions());
    std::vector<btBroadphaseProxy*> cubes;
    for (int i = 0; i < 40; ++i)
        cubes.push_back(addCube(broadphase, vec(3 * i, 0, 0)));
    CountingFilter filter(kNo);
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
    // The first cube visits the other cubes one after another.
    for (int visit = 1; visit < 40; ++visit)
    {
        moveCube(broadphase, cubes[0], vec(3 * visit + 0.5, 0, 0));
        EXPECT_EQ(updatedPairs(broadphase), Pairs{});
        EXPECT_EQ(broadphase.stats().pendingPairs, 1u) << visit;
        EXPECT_EQ(filter.askedCount, visit) << "each once";
    }
    moveCube(broadphase, cubes[0], vec(-9, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(broadphase.stats().pendingPairs, 0u);
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(nullptr);
}

TEST(BroadphaseFilter, AddsNoPairWhenCallbackDestroysOneOfItsProxies)
{
    Broadphase broadphase(bruteOptions());
    addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* victim = addCube(broadphase, vec(0.5, 0, 0));
    CountingFilter filter(
        [&](const btBroadphaseProxy&, const btBroadphaseProxy&)
        {
            if (victim != nullptr)
                broadphase.destroyProxy(std::exchange(victim, nullptr), nullptr);
            return true;
        });
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
    EXPECT_EQ(updatedPairs(broadphase), Pairs{});
    EXPECT_EQ(broadphase.stats().pendingPairs, 0u);
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(nullptr);
}
}  // namespace
}  // namespace cullet::test
