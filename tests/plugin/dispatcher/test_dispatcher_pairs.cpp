// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/dispatcher/pair_bench.h"

#include <gtest/gtest.h>

#include <deque>
#include <optional>

namespace cullet::test
{
TEST(DispatcherPairs, ProcessesPairMovedIntoSlotOfRemovedIdlePairDuringDispatch)
{
    static PairBench* bench = nullptr;
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    PairBench pairs;
    bench = &pairs;
    pairs.addPair(*cube, 0);
    pairs.addPair(*cube, 0.3);
    pairs.addPair(*cube, 0.3);
    pairs.dispatch(2);
    EXPECT_EQ(pairs.dispatcher.idlePairs(), 2u);
    // The last pair, which touches now, takes the index of the removed one.
    pairs.bodies[5].get()->setWorldTransform(pairs.bodies[4].get()->getWorldTransform());
    gContactProcessedCallback = [](btManifoldPoint&, void*, void*)
    {
        bench->cache.removeOverlappingPair(&bench->bodies[2].proxy, &bench->bodies[3].proxy,
                                           &bench->dispatcher);
        return true;
    };
    // Bullet reports persistent points.
    pairs.dispatch();
    gContactProcessedCallback = nullptr;
    ASSERT_EQ(pairs.cache.getNumOverlappingPairs(), 2);
    EXPECT_GT(pairs.contactsOfPair(0), 0);
    EXPECT_GT(pairs.contactsOfPair(2), 0);
    // Another idle pair.
    pairs.addPair(*cube, 0.3);
    pairs.dispatch();
    EXPECT_EQ(pairs.dispatcher.idlePairs(), 1u);
}

TEST(DispatcherPairs, KeepsNothingOfADispatcherThatWasAtItsAddress)
{
    // Leaked algorithms use its record permanently, so no other shape may be created at its address.
    static const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    btDefaultCollisionConfiguration configuration;
    std::optional<Dispatcher> dispatcher;
    std::optional<btHashedOverlappingPairCache> caches[2];
    std::deque<DoomedBody> rows[2];
    for (int life = 0; life < 2; ++life)
    {
        dispatcher.emplace(&configuration);
        caches[life].emplace();
        addDoomedRow(rows[life], *cube, *caches[life]);
        for (int i = 0; i < 3; ++i)
            dispatcher->dispatchAllCollisionPairs(&*caches[life], {}, &*dispatcher);
        EXPECT_EQ(dispatcher->stillPairs(), 4u) << "life " << life;
        // The algorithms leak, as in Bullet, and the bodies are destroyed.
        for (DoomedBody& body : rows[life])
            body.destroy();
    }
}

TEST(DispatcherPairs, RecognisesAlgorithmInReusedMemoryOfAnother)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    btBoxShape box(vec(0.5, 0.5, 0.5));
    PairBench pairs;
    for (int i = 0; i < 4; ++i)
        pairs.addPair(box, 0.3);
    const auto address = [&](int i) { return pairs.cache.getOverlappingPairArray()[i].m_algorithm; };
    int reused = 0;
    for (int round = 0; round < 6; ++round)
    {
        SCOPED_TRACE(round);
        const bool isHull = round % 2 == 0;
        pairs.dispatch(3);
        EXPECT_EQ(pairs.dispatcher.idlePairs(), isHull ? 0u : 4u);
        const btCollisionAlgorithm* before[4] = {address(0), address(1), address(2), address(3)};
        pairs.setShape(isHull ? static_cast<btCollisionShape&>(*cube) : box);
        // Created by the application's callback, without the dispatcher. The pool returns the last freed block first.
        for (int i = 3; i >= 0; --i)
            pairs.cache.cleanOverlappingPair(pairs.cache.getOverlappingPairArray()[i], &pairs.dispatcher);
        pairs.dispatcher.setNearCallback(
            [](btBroadphasePair& pair, btCollisionDispatcher& each, const btDispatcherInfo& info)
            { btCollisionDispatcher::defaultNearCallback(pair, each, info); });
        pairs.dispatch();
        pairs.dispatcher.setNearCallback(btCollisionDispatcher::defaultNearCallback);
        for (int i = 0; i < 4; ++i)
            reused += before[i] == address(i) ? 1 : 0;
    }
    EXPECT_GT(reused, 12);
}

TEST(DispatcherPairs, ProcessesWokenPairsThatMovedWhileAsleep)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    for (const bool areAllAsleep : {true, false})
    {
        SCOPED_TRACE(areAllAsleep);
        PairBench pairs;
        for (int i = 0; i < 3; ++i)
            pairs.addPair(*cube, 0.3);
        pairs.dispatch(3);
        EXPECT_EQ(pairs.dispatcher.stillPairs(), 3u);
        for (std::size_t i = areAllAsleep ? 0 : 1; i < 3; ++i)
            pairs.setState(i, ISLAND_SLEEPING);
        pairs.dispatch(2);
        // Those that are asleep need no work by Bullet either, but for that reason, whether their motions are known or
        // not.
        EXPECT_EQ(pairs.dispatcher.idlePairs(), areAllAsleep ? 0u : 1u);
        // Two motions that leave a pair separated, the first while it sleeps.
        pairs.closeGap(1, 0.15);
        pairs.dispatch();
        for (std::size_t i = 0; i < 3; ++i)
            pairs.setState(i, ACTIVE_TAG);
        pairs.closeGap(1, 0.15);
        pairs.dispatch();
        EXPECT_EQ(pairs.dispatcher.idlePairs(), 2u);
        EXPECT_GT(pairs.contactsOfPair(1), 0);
        pairs.dispatch();
        EXPECT_EQ(pairs.dispatcher.stillPairs(), 2u);
    }
}

TEST(DispatcherPairs, TestsPairsInTurnWhenFewBodiesAreAwake)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    PairBench pairs;
    // More than a sample.
    for (int i = 0; i < 160; ++i)
        pairs.addPair(*cube, 0.3);
    pairs.dispatch(3);
    EXPECT_EQ(pairs.dispatcher.stillPairs(), 160u);
    for (std::size_t i = 0; i < 160; ++i)
        pairs.setState(i, ISLAND_SLEEPING);
    pairs.dispatch();
    EXPECT_EQ(pairs.dispatcher.idlePairs(), 0u);
    int idle = 0;
    for (std::size_t i = 0; i < 160; ++i)
    {
        pairs.setState(i, ACTIVE_TAG);
        pairs.dispatch();
        idle += pairs.dispatcher.idlePairs() == 1 && pairs.dispatcher.stillPairs() == 0 ? 1 : 0;
        pairs.closeGap(i, 0.3);
        pairs.dispatch();
        EXPECT_GT(pairs.contactsOfPair(i), 0) << i;
        pairs.setState(i, ISLAND_SLEEPING);
    }
    EXPECT_GT(idle, 80);
}

TEST(DispatcherPairs, DiscardsSeparationProofMadeWhileMotionsWereUnknown)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    PairBench pairs;
    for (int i = 0; i < 160; ++i)
        pairs.addPair(*cube, 0.3);
    pairs.dispatch(3);
    for (std::size_t i = 0; i < 160; ++i)
        pairs.setState(i, ISLAND_SLEEPING);
    // A pair outside of the sample, separated when it is tested, and near at the positions of the last update.
    pairs.setState(1, ACTIVE_TAG);
    pairs.closeGap(1, -0.5);
    pairs.dispatch();
    EXPECT_EQ(pairs.dispatcher.idlePairs(), 1u);
    EXPECT_EQ(pairs.dispatcher.stillPairs(), 0u);
    for (std::size_t i = 0; i < 160; ++i)
        pairs.setState(i, ACTIVE_TAG);
    pairs.closeGap(1, 0.8);
    pairs.dispatch();
    EXPECT_GT(pairs.contactsOfPair(1), 0);
    EXPECT_EQ(pairs.dispatcher.idlePairs(), 159u);
}
}  // namespace cullet::test
