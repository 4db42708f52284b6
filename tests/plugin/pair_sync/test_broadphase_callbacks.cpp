// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Calls of the broad phase from inside callbacks for its pairs: filter, ghost callback, pass over the pairs.
#include "cullet/tests/plugin/pair_sync/ghost_world.h"

#include <functional>
#include <set>
#include <utility>

namespace cullet::test
{
namespace
{
struct CallingFilter final : btOverlapFilterCallback
{
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
    {
        const std::uint64_t key = pairKey(makePair(idOf(a), idOf(b)));
        EXPECT_TRUE(running.insert(key).second) << "called within its own call";
        ++calls;
        if (calls < 1000)
            onCall(*a, *b);
        running.erase(key);
        return answer;
    }
    std::function<void(btBroadphaseProxy&, btBroadphaseProxy&)> onCall;
    bool answer = true;
    mutable std::set<std::uint64_t> running;
    mutable int calls = 0;
};

TEST(BroadphaseCallbacks, CallFilterOncePerPairWhenItMovesGhost)
{
    for (const bool answer : {false, true})
    {
        GhostWorld scene;
        auto* ghost = scene.add<btGhostObject>(vec(9, 0, 0));
        for (int i = 0; i < 3; ++i)
            scene.add<btCollisionObject>(vec(0.1 * i, 0, 0));
        CallingFilter filter;
        filter.answer = answer;
        filter.onCall = [&](btBroadphaseProxy&, btBroadphaseProxy&)
        { scene.move(ghost, vec(0.001 * filter.calls, 0, 0)); };
        scene.world.getPairCache()->setOverlapFilterCallback(&filter);
        scene.world.performDiscreteCollisionDetection();
        scene.world.performDiscreteCollisionDetection();
        EXPECT_EQ(ghost->getNumOverlappingObjects(), answer ? 3 : 0);
        EXPECT_EQ(pairsOf(scene.broadphase).size(), answer ? 6u : 0u);
        EXPECT_GE(filter.calls, 6);
        EXPECT_LT(filter.calls, 100);
        EXPECT_EQ(scene.callback.live.size(), answer ? 6u : 0u);
        scene.world.getPairCache()->setOverlapFilterCallback(nullptr);
    }
}

TEST(BroadphaseCallbacks, KeepPairsWhenFilterRemovesOrCleansThem)
{
    GhostWorld scene;
    std::vector<btCollisionObject*> bodies;
    for (int i = 0; i < 4; ++i)
        bodies.push_back(scene.add<btCollisionObject>(vec(0.1 * i, 0, 0)));
    scene.world.performDiscreteCollisionDetection();
    ASSERT_EQ(pairsOf(scene.broadphase).size(), 6u);
    btOverlappingPairCache& cache = *scene.world.getPairCache();
    auto* late = scene.add<btCollisionObject>(vec(0.2, 0, 0));
    CallingFilter filter;
    filter.onCall = [&](btBroadphaseProxy& a, btBroadphaseProxy& b)
    {
        btBroadphaseProxy* const other = &a == late->getBroadphaseHandle() ? &b : &a;
        cache.cleanProxyFromPairs(other, &scene.dispatcher);
        if (filter.calls == 2)
            cache.removeOverlappingPairsContainingProxy(bodies[0]->getBroadphaseHandle(), &scene.dispatcher);
    };
    cache.setOverlapFilterCallback(&filter);
    scene.world.performDiscreteCollisionDetection();
    EXPECT_EQ(filter.calls, 4);
    // The first body has lost all pairs, its new one too.
    EXPECT_EQ(pairsOf(scene.broadphase), (Pairs{{2, 3}, {2, 4}, {2, 5}, {3, 4}, {3, 5}, {4, 5}}));
    EXPECT_EQ(scene.callback.live.size(), 6u);
    EXPECT_EQ(scene.dispatcher.getNumManifolds(), 6) << "one of each pair, made anew where it was cleaned";
    scene.move(bodies[0], vec(5, 0, 0));
    scene.world.performDiscreteCollisionDetection();
    scene.move(bodies[0], vec(0, 0, 0));
    scene.world.performDiscreteCollisionDetection();
    EXPECT_EQ(pairsOf(scene.broadphase).size(), 10u);
    cache.setOverlapFilterCallback(nullptr);
}

/// Calls a function for each pair.
struct Pass final : btOverlapCallback
{
    bool processOverlap(btBroadphasePair& pair) override
    {
        EXPECT_TRUE(visited.insert(pairKey({idOf(pair.m_pProxy0), idOf(pair.m_pProxy1)})).second);
        return onPair(pair);
    }
    std::function<bool(btBroadphasePair&)> onPair;
    std::set<std::uint64_t> visited;
};

TEST(BroadphaseCallbacks, FinishPassWhenItDestroysProxiesOfVisitedPairs)
{
    for (int variant = 0; variant < 8; ++variant)
    {
        const bool isOrdered = (variant & 1) != 0, answer = (variant & 2) != 0, isFirst = (variant & 4) != 0;
        GhostWorld scene;
        for (int i = 0; i < 10; ++i)
            scene.add<btCollisionObject>(vec(0.05 * i, 0, 0));
        scene.world.performDiscreteCollisionDetection();
        ASSERT_EQ(scene.dispatcher.getNumManifolds(), 45);
        Pass pass;
        int removedCount = 0;
        pass.onPair = [&](btBroadphasePair& pair)
        {
            btBroadphaseProxy* const proxy = isFirst ? pair.m_pProxy0 : pair.m_pProxy1;
            if (idOf(proxy) % 3 != 0)
                return false;
            ++removedCount;
            scene.world.removeCollisionObject(static_cast<btCollisionObject*>(proxy->m_clientObject));
            return answer;
        };
        btDispatcherInfo info;
        info.m_deterministicOverlappingPairs = isOrdered;
        scene.world.getPairCache()->processAllOverlappingPairs(&pass, &scene.dispatcher, info);
        EXPECT_EQ(removedCount, 3) << variant;
        EXPECT_EQ(scene.world.getNumCollisionObjects(), 7);
        EXPECT_EQ(pairsOf(scene.broadphase).size(), 21u);
        EXPECT_EQ(scene.dispatcher.getNumManifolds(), 21);
        EXPECT_EQ(scene.callback.live.size(), 21u);
        EXPECT_GE(pass.visited.size(), 21u) << "each pair that is left";
        scene.world.performDiscreteCollisionDetection();
        EXPECT_EQ(pairsOf(scene.broadphase).size(), 21u);
    }
}

/// A ghost callback that changes the cache inside its calls.
struct Meddler final : btOverlappingPairCallback
{
    btBroadphasePair* addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) override
    {
        ++balance;
        onAdd(a, b);
        return nullptr;
    }
    void* removeOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b, btDispatcher*) override
    {
        --balance;
        onRemove(a, b);
        return nullptr;
    }
    void removeOverlappingPairsContainingProxy(btBroadphaseProxy*, btDispatcher*) override { ADD_FAILURE(); }
    using Call = std::function<void(btBroadphaseProxy*, btBroadphaseProxy*)>;
    Call onAdd = [](btBroadphaseProxy*, btBroadphaseProxy*) {};
    Call onRemove = onAdd;
    int balance = 0;
};

TEST(BroadphaseCallbacks, FollowGhostCallbackThatAddsAndRemovesPairs)
{
    Broadphase broadphase(bruteOptions());
    btOverlappingPairCache& cache = *broadphase.getOverlappingPairCache();
    Meddler meddler;
    std::vector<btBroadphaseProxy*> cubes;
    std::vector<btCollisionObject> objects(6);
    for (int i = 0; i < 6; ++i)
        cubes.push_back(addCube(broadphase, vec(i < 4 ? 0.1 * i : 20.0 * i, 0, 0), 0.5, 1, kAllGroups,
                                &objects[std::size_t(i)]));
    cache.setInternalGhostPairCallback(&meddler);
    // The pair of the first two is taken out as it comes; each of another is followed by one far away.
    meddler.onAdd = [&](btBroadphaseProxy* a, btBroadphaseProxy* b)
    {
        if (a == cubes[0] && b == cubes[1])
            cache.removeOverlappingPair(b, a, nullptr);
        else if (b == cubes[3])
            cache.addOverlappingPair(a, cubes[4]);
    };
    EXPECT_EQ(updatedPairs(broadphase),
              (Pairs{{1, 3}, {1, 4}, {1, 5}, {2, 3}, {2, 4}, {2, 5}, {3, 4}, {3, 5}}));
    EXPECT_EQ(meddler.balance, 8);
    EXPECT_EQ(broadphase.stats().pendingPairs, 1u) << "the pair that was taken out";
    // Pairs of the application leave, as their boxes are apart, and take another one with them.
    meddler.onAdd = [](btBroadphaseProxy*, btBroadphaseProxy*) {};
    meddler.onRemove = [&](btBroadphaseProxy* a, btBroadphaseProxy* b)
    {
        if (b == cubes[4])
            cache.removeOverlappingPair(a, cubes[3], nullptr);
    };
    for (int update = 0; update < 3; ++update)
    {
        moveCube(broadphase, cubes[4], vec(80 + update, 0, 0));
        broadphase.calculateOverlappingPairs(nullptr);
    }
    EXPECT_EQ(pairsOf(broadphase), (Pairs{{1, 3}, {2, 3}}));
    EXPECT_EQ(meddler.balance, 2);
    cache.setInternalGhostPairCallback(nullptr);
}
}  // namespace
}  // namespace cullet::test
