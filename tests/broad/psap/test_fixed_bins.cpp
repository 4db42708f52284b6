// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Bins of fixed capacity: when they are used, and what happens if one is full.

#include "cullet/tests/broad/psap/counting_search_probe.h"

namespace cullet::test
{
namespace
{
TEST(PsapBins, FindAllPairsInWorldsOfUpTo65536Boxes)
{
    SCOPED_TRACE("seed 5");
    Random random(5);
    for (const std::uint32_t count :
         {1u, 40u, 3000u, 30000u, 1u << 16})  // with four lanes for a box, with two, with one
    {
        const std::vector<Aabb> boxes = cubesIn(count, 4, random);
        WatchedSearch search;
        const Pairs expected = pairsByCounting(boxes);
        for (int update = 1; update <= 3; ++update)
        {
            EXPECT_EQ(search.find(boxes), expected) << count;
            EXPECT_FALSE(search.wasFull()) << count;
            EXPECT_EQ(search.searchesOfBins(), update) << count;
        }
    }
}

TEST(PsapBins, AreNotUsedInWorldsOfMoreThan65536Boxes)
{
    Random random(6);
    const std::vector<Aabb> boxes = cubesIn((1u << 16) + 1, 4, random);
    WatchedSearch search;
    search.find(boxes);
    EXPECT_EQ(search.searchesOfBins(), 0);
}

TEST(PsapBins, AreNotUsedWhenManyPairsAreExpected)
{
    SCOPED_TRACE("seed 10");
    Random random(10);
    const std::vector<Aabb> cubes = cubesIn(1000, 4, random);
    WatchedSearch ofOneSize;
    const Pairs found = ofOneSize.find(cubes, 163000);
    EXPECT_EQ(ofOneSize.find(cubes, 162000), found);
    EXPECT_EQ(ofOneSize.searchesOfBins(), 1);

    std::vector<Aabb> boxes;
    for (const Aabb& cube : cubesIn(1000, 0.1f, random))
        boxes.push_back(boxAt(cube.min[0], cube.min[1], cube.min[2], random.logUniform(-6, 0)));
    WatchedSearch ofManySizes;
    const Pairs expected = everyPair(boxes);
    for (const std::uint64_t pairs : {160000u, 30000u, 32000u})  // sizes are unknown at first
    {
        EXPECT_EQ(ofManySizes.find(boxes, pairs), expected) << pairs;
        EXPECT_FALSE(ofManySizes.wasFull()) << pairs;
    }
    EXPECT_EQ(ofManySizes.searchesOfBins(), 2);
}

TEST(PsapBins, FallBackToCountingWhenBinIsFull)
{
    SCOPED_TRACE("seed 7");
    Random random(7);
    const std::vector<Aabb> sparse = cubesIn(1000, 4, random);
    std::vector<Aabb> piled = sparse;
    piled.insert(piled.end(), 13, sparse[500]);
    const Pairs expected = everyPair(piled);
    WatchedSearch search;
    EXPECT_EQ(search.find(sparse), everyPair(sparse));
    EXPECT_EQ(search.find(piled), expected);
    EXPECT_TRUE(search.wasFull());
    // Further updates.
    for (int update = 0; update < 256; ++update)
    {
        ASSERT_EQ(search.find(piled), expected) << update;
        ASSERT_FALSE(search.wasFull()) << update;
    }
    EXPECT_EQ(search.searchesOfBins(), 2);
    EXPECT_EQ(search.find(piled), expected);
    EXPECT_TRUE(search.wasFull());
    EXPECT_EQ(search.searchesOfBins(), 3);
}

// With up to a dozen cells across, a cell ahead of a box may be a wrapped cell behind it.
TEST(PsapBins, FindEachPairOnceWhenGridHasFewCells)
{
    SCOPED_TRACE("seed 8");
    Random random(8);
    int inBins = 0;
    for (float side = 3; side < 60; side *= 1.1f)
    {
        std::vector<Aabb> boxes;
        for (std::uint32_t i = 0; i < 60; ++i)
            boxes.push_back(boxAt(random.point(0, side)));
        // Some boxes far outside of the planned range, and a larger one.
        for (std::uint32_t i = 0; i < 6; ++i)
        {
            const float y = random.between(0, side), x = random.between(-9 * side, 9 * side);
            boxes.push_back(boxAt(x, y, side / 2));
        }
        for (std::uint32_t i = 0; i < 3; ++i)
            boxes.push_back({{random.between(0, side), 0, 0}, {2 * side, side / 3, side / 3}});
        const Pairs expected = everyPair(boxes);
        // The last one has windows over many bins.
        for (const float scale : {0.0f, 0.5f, 3.0f, 0.1f})
        {
            PsapOptions options;
            options.cellScale = options.binScale = scale;
            WatchedSearch search(options);
            EXPECT_EQ(search.find(boxes), expected) << side << ", " << scale;
            inBins += search.wasFull() ? 0 : 1;
        }
    }
    EXPECT_GT(inBins, 60) << "of 128";
}

// Boxes created after the plan: larger ones, far ones, and some without a cell.
TEST(PsapBins, FindAllPairsWithPlanOfEarlierFrame)
{
    SCOPED_TRACE("seed 9");
    Random random(9);
    WatchedSearch search;
    std::vector<Aabb> boxes = cubesIn(1000, 4, random);
    EXPECT_EQ(search.find(boxes), everyPair(boxes));
    makeSomeUnplanned(boxes, random);
    EXPECT_EQ(search.find(boxes), everyPair(boxes));
    EXPECT_EQ(search.searchesOfBins(), 2);
    EXPECT_FALSE(search.wasFull());
}
}  // namespace
}  // namespace cullet::test
