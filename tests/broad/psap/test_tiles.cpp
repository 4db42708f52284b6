// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Tiles: when they are used, and what happens if one is full.

#include "cullet/tests/broad/psap/counting_search_probe.h"

#include <cmath>

namespace cullet::test
{
namespace
{
TEST(PsapTiles, FindAllPairsInLargeWorldsOfEqualBoxes)
{
    SCOPED_TRACE("seed 5");
    Random random(5);
    const std::vector<Aabb> boxes = cubesIn((1u << 16) + 1, 4, random);
    const Pairs expected = pairsByCounting(boxes);
    ASSERT_GT(expected.size(), 50000u);
    WatchedSearch search;
    // The first update makes the plan.
    for (int update = 0; update < 4; ++update)
    {
        EXPECT_EQ(search.find(boxes), expected) << update;
        EXPECT_FALSE(search.wasFull()) << update;
        EXPECT_EQ(search.searchesOfTiles(), update);
    }
    EXPECT_GT(search.exec.lastShape.tiles, 200u);
}

TEST(PsapTiles, AreNotUsedInSmallDenseOrMixedWorlds)
{
    SCOPED_TRACE("seed 6");
    Random random(6);
    std::vector<Aabb> mixed = cubesIn(70000, 40, random);
    for (Aabb& box : mixed)
        box = boxAt(box.min[0], box.min[1], box.min[2], random.logUniform(-2, 1));
    for (const std::vector<Aabb>& boxes : {cubesIn(1u << 16, 4, random), cubesIn(70000, 1, random), mixed})
    {
        WatchedSearch search;
        for (int update = 0; update < 3; ++update)
            search.find(boxes);
        EXPECT_EQ(search.searchesOfTiles(), 0) << boxes.size();
    }
}

TEST(PsapTiles, AreNotUsedWhenDeviceHasTooLittleMemory)
{
    Random random(7);
    const std::vector<Aabb> boxes = cubesIn(70000, 4, random);
    WatchedSearch search;
    search.exec.mostTiles = 10;
    for (int update = 0; update < 3; ++update)
        search.find(boxes);
    EXPECT_EQ(search.searchesOfTiles(), 0);
}

// Cells, bins and tiles cover the bulk of the boxes: with one far box in their range the others would be like one
// point.
TEST(PsapTiles, KeepTestCountLowWhenSomeBodiesAreFarAway)
{
    SCOPED_TRACE("seed 12");
    Random random(12);
    for (const PsapOrder order : {PsapOrder::Counting, PsapOrder::Bins, PsapOrder::Tiles})
    {
        std::vector<Aabb> boxes = cubesIn(6000, 4, random);
        WatchedSearch search(order);
        search.find(boxes);
        search.find(boxes);
        search.exec.collectTestCount();
        search.find(boxes);
        const std::uint64_t tests = search.exec.collectTestCount();
        boxes[3] = boxAt(3e4f, 0, 0);
        boxes[4000] = boxAt(0, -1e9f, 0);
        boxes[4001] = boxAt(0, 0, 1e30f);
        WatchedSearch another(order);
        const Pairs expected = everyPair(boxes);
        for (int update = 0; update < 3; ++update)
            EXPECT_EQ(another.find(boxes), expected);
        another.exec.collectTestCount();
        another.find(boxes);
        EXPECT_LT(another.exec.collectTestCount(), 2 * tests) << static_cast<int>(order);
        EXPECT_FALSE(another.wasFull()) << static_cast<int>(order);
    }
}

// Few large boxes, and some without bounds, are tested against all others.
TEST(PsapTiles, FindAllPairsWithFewLargeAndUnboundedBoxes)
{
    SCOPED_TRACE("seed 8");
    Random random(8);
    std::vector<Aabb> boxes = cubesIn(70000, 4, random);
    boxes[17] = {{-10, -10, -10}, {80, 3, 80}};
    boxes[69999] = {{-10, -10, 20}, {80, 80, 24}};
    boxes[40000] = {{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, 2, kInfinity}};
    boxes[40001] = {{kNan, 0, 0}, {1, 1, 1}};
    boxes[40002] = {{1e30f, 1e30f, 1e30f}, {1e30f, 1e30f, 1e30f}};
    boxes[40003] = {{5, 5, 5}, {4, 4, 4}};
    const Pairs expected = pairsByCounting(boxes);
    for (const PsapExecutor executor : {PsapExecutor::InOrder, PsapExecutor::Shuffled, PsapExecutor::Threads})
    {
        WatchedSearch search(PsapOrder::Automatic, executor);
        EXPECT_EQ(search.find(boxes), expected);
        EXPECT_EQ(search.find(boxes), expected);
        EXPECT_EQ(search.searchesOfTiles(), 1);
        EXPECT_FALSE(search.wasFull());
    }
}

TEST(PsapTiles, FallBackToCountingWhenTileIsFull)
{
    SCOPED_TRACE("seed 9");
    Random random(9);
    const std::vector<Aabb> sparse = cubesIn(70000, 4, random);
    std::vector<Aabb> piled = sparse;
    for (std::uint32_t i = 0; i < 1500; ++i)
        piled[40 * i] = boxAt(random.point(30, 40));
    const Pairs expected = pairsByCounting(piled);
    WatchedSearch search;
    for (int update = 0; update < 20; ++update)
        search.find(sparse);
    EXPECT_EQ(search.searchesOfTiles(), 19);
    EXPECT_EQ(search.find(piled), expected);
    EXPECT_TRUE(search.wasFull());
    // By the counting-sort search, until a plan accounts for the pile.
    EXPECT_EQ(search.find(piled), expected);
    EXPECT_EQ(search.searchesOfTiles(), 20);
    EXPECT_EQ(search.find(piled), expected);
    EXPECT_FALSE(search.wasFull());
    EXPECT_EQ(search.searchesOfTiles(), 21);
    // After a failed recent plan, tiles are not tried again for a while.
    EXPECT_EQ(search.find(sparse), pairsByCounting(sparse));
    std::vector<Aabb> heap = sparse;
    for (std::uint32_t i = 0; i < 20000; ++i)
        heap[3 * i] = boxAt(random.point(1, 15));
    EXPECT_EQ(search.find(heap), pairsByCounting(heap));
    EXPECT_TRUE(search.wasFull());
    const int searches = search.searchesOfTiles();
    for (int update = 0; update < 256; ++update)
        search.find(sparse);
    EXPECT_EQ(search.searchesOfTiles(), searches);
    for (int update = 0; update < 3; ++update)
        EXPECT_EQ(search.find(sparse), pairsByCounting(sparse));
    EXPECT_GT(search.searchesOfTiles(), searches);
}

TEST(PsapTiles, FindAllPairsUntilTileIsFull)
{
    SCOPED_TRACE("seed 13");
    Random random(13);
    std::vector<Aabb> boxes = cubesIn(1500, 4, random);
    WatchedSearch search(PsapOrder::Tiles);
    search.find(boxes);
    // Bodies move one after the other to the same position.
    std::uint32_t piled = 0;
    while (!search.wasFull())
    {
        ASSERT_LT(piled, 1500u);
        boxes[piled++] = boxAt(8.1f, 8.1f, 8.1f, 0.01f);
        ASSERT_EQ(search.find(boxes), everyPair(boxes)) << piled;
    }
    EXPECT_GT(piled, 20u);
}

TEST(PsapTiles, AreFullOnlyWhenMoreThanThirtyTwoBoxesAreTooLarge)
{
    SCOPED_TRACE("seed 14");
    Random random(14);
    const std::vector<Aabb> boxes = cubesIn(1000, 4, random);
    for (const std::uint32_t large : {31u, 32u, 33u, 34u})
    {
        SCOPED_TRACE(large);
        WatchedSearch search(PsapOrder::Tiles);
        search.find(boxes);
        std::vector<Aabb> changed = boxes;
        for (std::uint32_t i = 0; i < large; ++i)
            changed[20 * i] = boxAt(random.point(0, 16), 1.5f);
        EXPECT_EQ(search.find(changed), everyPair(changed));
        EXPECT_EQ(search.searchesOfTiles(), 1);
        EXPECT_EQ(search.wasFull(), large > 32);
    }
}

// Flat, long and sparse worlds, few boxes and many, tiles narrower than boxes; sizes that differ.
TEST(PsapTiles, FindAllPairsInAnyWorldWhenForced)
{
    SCOPED_TRACE("seed 10");
    Random random(10);
    int inTiles = 0;
    std::size_t pairs = 0;
    for (const std::uint32_t count : {1u, 2u, 30u, 400u, 3000u})
        for (const float volume : {0.01f, 0.3f, 4.0f, 1000.0f})
            for (const float flat : {0.0f, 0.01f, 1.0f})
            {
                std::vector<Aabb> boxes =
                    cubesIn(count, volume, random, 1, 1 + 8 * flat, flat == 0 ? 1e-6f : flat);
                for (std::uint32_t i = 0; i < count; i += 3)
                    boxes[i] =
                        boxAt(boxes[i].min[0], boxes[i].min[1], boxes[i].min[2], random.between(0, 1.5f));
                const Pairs expected = everyPair(boxes);
                WatchedSearch search(PsapOrder::Tiles);
                for (int update = 0; update < 2; ++update)
                    ASSERT_EQ(search.find(boxes), expected) << count << ", " << volume << ", " << flat;
                if (search.searchesOfTiles() != 0 && !search.wasFull())
                {
                    ++inTiles;
                    pairs += expected.size();
                }
            }
    EXPECT_GT(inTiles, 40) << "of 60";
    EXPECT_GT(pairs, 100000u);
}

TEST(PsapTiles, AreNoMorePerAxisThanTheirTableHas)
{
    SCOPED_TRACE("seed 12");
    Random random(12);
    const std::vector<Aabb> boxes = cubesIn(30000, 4, random, 1e6f);
    const Pairs expected = pairsByCounting(boxes);
    ASSERT_GT(expected.size(), 1000u);
    WatchedSearch search(PsapOrder::Tiles);
    for (int update = 0; update < 2; ++update)
        EXPECT_EQ(search.find(boxes), expected) << update;
    EXPECT_GT(search.searchesOfTiles(), 0);
    EXPECT_EQ(search.exec.lastShape.tiles, 128u);
}

// Boxes created after the plan, larger and far ones; coordinates on the edges of tiles.
TEST(PsapTiles, FindAllPairsWithPlanOfEarlierFrame)
{
    SCOPED_TRACE("seed 11");
    Random random(11);
    WatchedSearch search(PsapOrder::Tiles);
    std::vector<Aabb> boxes = cubesIn(1000, 4, random);
    for (Aabb& box : boxes)
        box = boxAt(std::floor(box.min[0]), std::floor(box.min[1]), std::floor(box.min[2]));
    EXPECT_EQ(search.find(boxes), everyPair(boxes));
    EXPECT_EQ(search.find(boxes), everyPair(boxes));
    makeSomeUnplanned(boxes, random);
    EXPECT_EQ(search.find(boxes), everyPair(boxes));
    EXPECT_EQ(search.searchesOfTiles(), 2);
    EXPECT_FALSE(search.wasFull());
    // More large boxes than the overflow list holds.
    for (std::uint32_t i = 0; i < 40; ++i)
        boxes[20 * i] = boxAt(random.point(0, 16), 1.5f);
    EXPECT_EQ(search.find(boxes), everyPair(boxes));
    EXPECT_TRUE(search.wasFull());
}

TEST(PsapTiles, MeetInQuantaExactlyWhenEveryIntervalDoes)
{
    SCOPED_TRACE("seed 37");
    Random random(37);
    using psap::TileBox;
    constexpr std::uint32_t kBits[3] = {TileBox::kBitsS, TileBox::kBitsU, TileBox::kBitsV};
    int met = 0, apartOnOneAxis = 0;
    for (int trial = 0; trial < 20000; ++trial)
    {
        std::uint32_t corners[2][2][3];
        for (auto& box : corners)
            for (int axis = 0; axis < 3; ++axis)
            {
                // Few values, or all that there are.
                const std::uint32_t most = trial % 2 == 0 ? 4 : 1u << kBits[axis];
                box[0][axis] = random.below(most);
                box[1][axis] = box[0][axis] + random.below(most - box[0][axis]);
            }
        int apart = 0;
        for (int axis = 0; axis < 3; ++axis)
            apart += corners[0][0][axis] > corners[1][1][axis] || corners[1][0][axis] > corners[0][1][axis]
                         ? 1
                         : 0;
        const auto packed = [&](int box, int side)
        { return TileBox::packed(corners[box][side][0], corners[box][side][1], corners[box][side][2]); };
        const TileBox a = {packed(0, 0), packed(0, 1)}, b = {packed(1, 0), packed(1, 1)};
        ASSERT_EQ(a.mayMeet(b), apart == 0) << trial;
        ASSERT_EQ(b.mayMeet(a), apart == 0) << trial;
        met += apart == 0 ? 1 : 0;
        apartOnOneAxis += apart == 1 ? 1 : 0;
    }
    EXPECT_GT(met, 2000);
    EXPECT_GT(apartOnOneAxis, 2000);
}
}  // namespace
}  // namespace cullet::test
