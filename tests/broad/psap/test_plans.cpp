// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The first plan of a search is made synchronously, later plans asynchronously while updates use the previous one.

#include "cullet/tests/broad/psap/counting_search_probe.h"

namespace cullet::test
{
namespace
{
/// @return box tests of one more update, which finds the pairs
std::uint64_t testsOf(WatchedSearch& search, const std::vector<Aabb>& boxes, const Pairs& pairs)
{
    search.exec.collectTestCount();
    EXPECT_EQ(search.find(boxes), pairs);
    return search.exec.collectTestCount();
}

/// Boxes close together, and the same number spread out.
struct GrowingWorld
{
    explicit GrowingWorld(std::uint32_t seed) : random(seed) {}

    Random random;
    const std::vector<Aabb> dense = cubesIn(6000, 4, random);
    const std::vector<Aabb> sparse = cubesIn(6000, 4000, random);
    const Pairs pairs = everyPair(sparse);
};

TEST(PsapPlans, ReduceTestsAgainAfterWorldSpreadsOut)
{
    SCOPED_TRACE("seed 3");
    const GrowingWorld world(3);
    WatchedSearch fresh(PsapOrder::Counting);
    const std::uint64_t fewest = testsOf(fresh, world.sparse, world.pairs);
    PsapOptions options;
    options.order = PsapOrder::Counting;
    options.updatesPerPlan = 3;
    WatchedSearch search(options);
    search.find(world.dense);
    EXPECT_GT(testsOf(search, world.sparse, world.pairs), 2 * fewest);
    for (int update = 0; update < 20; ++update)
        search.find(world.sparse);
    EXPECT_LE(testsOf(search, world.sparse, world.pairs), fewest + fewest / 10);
}

// Most boxes are then far from the bulk of the boxes at the time of the last plan.
TEST(PsapPlans, FindAllPairsInEveryUpdateAfterWorldSpreadsOut)
{
    SCOPED_TRACE("seed 3");
    const GrowingWorld world(3);
    WatchedSearch search(PsapOrder::Counting);
    search.find(world.dense);
    for (int update = 0; update < 80; ++update)
        ASSERT_EQ(search.find(world.sparse), world.pairs) << update;
}

/// Cubes of another size and density in each frame.
std::vector<Aabb> breathing(int frame)
{
    Random random(static_cast<std::uint32_t>(frame));
    std::vector<Aabb> boxes = cubesIn(2000, 2 + static_cast<float>(frame % 5), random);
    for (Aabb& box : boxes)
    {
        for (int axis = 0; axis < 3; ++axis)
            box.max[axis] = box.min[axis] + 1 + 0.2f * static_cast<float>(frame % 7);
    }
    return boxes;
}

void expectSearchesToRepeat(PsapOrder order)
{
    SCOPED_TRACE(static_cast<int>(order));
    PsapOptions options;
    options.order = order;
    options.updatesPerPlan = 1;
    WatchedSearch search(options);
    for (int frame = 0; frame < 60; ++frame)
    {
        const Pairs pairs = search.find(breathing(frame));
        ASSERT_GT(pairs.size(), 1000u);
        ASSERT_EQ(search.findAgain(), pairs) << frame;
    }
}

// The search is repeated for a list that was too short, when the next plan may be ready.
TEST(PsapPlans, DoNotChangeWhenSearchIsRetried)
{
    for (const PsapOrder order : {PsapOrder::Counting, PsapOrder::Bins, PsapOrder::Tiles})
        expectSearchesToRepeat(order);
}

// Bins and tiles are in two memories, which updates use in turn; each memory has its own recorded launches.
TEST(PsapPlans, AlternatePhasesWhetherLaunchesAreRepeatedOrNot)
{
    SCOPED_TRACE("seed 5");
    Random random(5);
    const std::vector<Aabb> boxes = cubesIn(1000, 4, random);
    for (const PsapOrder order : {PsapOrder::Counting, PsapOrder::Bins, PsapOrder::Tiles})
    {
        SCOPED_TRACE(static_cast<int>(order));
        WatchedSearch search(order);
        search.find(boxes);
        search.find(boxes);
        const unsigned first = search.nextPhase();
        search.find(boxes);
        const unsigned second = search.nextPhase();
        EXPECT_EQ(second == first, order == PsapOrder::Counting);
        search.countRepeat();
        EXPECT_EQ(search.nextPhase(), first);
        search.countRepeat();
        EXPECT_EQ(search.nextPhase(), second);
        EXPECT_EQ(search.find(boxes), everyPair(boxes));
        EXPECT_EQ(search.nextPhase(), first);
    }
}

TEST(PsapPlans, AvoidFullBinsAgainAfterBoxesSpreadOut)
{
    SCOPED_TRACE("seed 4");
    const GrowingWorld world(4);
    PsapOptions options;
    options.order = PsapOrder::Bins;
    options.updatesPerPlan = 3;
    WatchedSearch search(options);
    search.find(world.dense);
    EXPECT_FALSE(search.wasFull());
    EXPECT_EQ(search.find(world.sparse), world.pairs);
    EXPECT_TRUE(search.wasFull());
    for (int update = 0; update < 20; ++update)
        search.find(world.sparse);
    EXPECT_EQ(search.find(world.sparse), world.pairs);
    EXPECT_FALSE(search.wasFull());
}

TEST(PsapPlans, AvoidFullTilesWhenRemadeOftenWhileBoxesMoveAway)
{
    SCOPED_TRACE("seed 13");
    Random random(13);
    std::vector<Aabb> boxes = cubesIn(6000, 4, random);
    PsapOptions options;
    options.order = PsapOrder::Tiles;
    WatchedSearch once(options);
    options.updatesPerPlan = 1;
    WatchedSearch often(options);
    int fullOnce = 0;
    constexpr int kUpdates = 200;
    for (int update = 0; update < kUpdates; ++update)
    {
        for (Aabb& box : boxes)
            box = boxAt(box.min[0] + 0.55f, box.min[1] + 0.5f, box.min[2] + 0.5f);
        const Pairs pairs = often.find(boxes);
        EXPECT_FALSE(often.wasFull()) << update;
        EXPECT_EQ(once.find(boxes), pairs) << update;
        fullOnce += once.wasFull() ? 1 : 0;
    }
    EXPECT_EQ(often.searchesOfTiles(), kUpdates - 1);
    EXPECT_GT(fullOnce, 0);
    EXPECT_EQ(often.find(boxes), everyPair(boxes));
}

TEST(PsapPlans, AreMadeAfterAReservationThatFailed)
{
    Random random(12);
    const std::vector<Aabb> boxes = cubesIn(400, 4, random);
    const Pairs expected = pairsByCounting(boxes);
    for (const PsapOrder order : {PsapOrder::Automatic, PsapOrder::Counting})
    {
        SCOPED_TRACE(static_cast<int>(order));
        int failed = 0;
        for (bool isMet = true; isMet; failed += isMet ? 1 : 0)
        {
            WatchedSearch search(order);
            search.exec.reservesLeft = failed;
            try
            {
                search.find(boxes);
                isMet = false;
            }
            catch (const std::bad_alloc&)
            {
                search.exec.reservesLeft = -1;
                EXPECT_EQ(search.find(boxes), expected) << "seed 12, reservation " << failed;
            }
        }
        EXPECT_GT(failed, 5);
    }
}
}  // namespace
}  // namespace cullet::test
