// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Warp-cooperative search: records search together, like the lanes of a GPU's warp. It finds exactly the overlapping
// pairs in every scene.

#include "cullet/tests/broad/psap/counting_search_probe.h"
#include "cullet/tests/broad/psap/warp_exec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace cullet::test
{
namespace
{
PsapOptions inGroups(PsapOptions options = {})
{
    options.order = PsapOrder::Counting;
    options.rowSearch = PsapRowSearch::Grouped;
    return options;
}

template <class Exec, class IsNew>
Pairs findWith(Exec& exec, psap::CountingSearch<Exec>& search, const std::vector<Aabb>& boxes,
               const IsNew& isNew)
{
    std::vector<RowPair> found(1u << 17);
    std::uint64_t count = 0;
    search.build(exec, {boxes.data(), boxes.size(), &count});
    search.emit(exec, isNew, {found.data(), found.size(), &count});
    search.planner().poll(exec);
    EXPECT_LE(count, found.size());
    found.resize(std::min<std::size_t>(count, found.size()));
    return inOrder(found);
}

struct Found
{
    Pairs pairs;
    std::uint32_t levels = 0;
    std::uint32_t largestSum = 0;
    std::uint32_t mostAtOnce = 0;
    std::uint64_t tests = 0;
};

template <class IsNew>
Found searchTogether(const std::vector<Aabb>& boxes, const IsNew& isNew, const PsapOptions& options = {})
{
    WarpExec exec(options);
    psap::CountingSearch<WarpExec> search(inGroups(options), options.axis);
    const Pairs pairs = findWith(exec, search, boxes, isNew);
    return {pairs, search.levelCount(), exec.largestSum, exec.mostAtOnce, exec.tests};
}

/// An entry test that needs rows and depths.
struct ShallowAndEven
{
    ShallowAndEven preloaded() const { return *this; }
    bool operator()(RowPair pair) const { return (pair.a + pair.b) % 2 == 0; }
    template <class Depth>
    bool operator()(RowPair pair, const Depth& depth) const
    {
        return (*this)(pair) && depth() < 0.5f;
    }
    template <class Depth>
    bool operator()(RowPair pair, float, const Depth& depth) const
    {
        return (*this)(pair, depth);
    }
};

/// Boxes of sizes over nine octaves.
std::vector<Aabb> boxesOfManySizes(std::uint32_t count, float side, Random& random)
{
    std::vector<Aabb> boxes;
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const float half = random.logUniform(-6, 3);
        boxes.push_back(boxAt(random.point(0, side), half));
    }
    return boxes;
}

// 404 boxes: the last group has twenty.
TEST(WarpSearch, FindsPairsOfDenseScene)
{
    SCOPED_TRACE("seed 1");
    Random random(1);
    const std::vector<Aabb> boxes = cubesIn(404, 0.41f, random);
    const Pairs expected = everyPair(boxes);
    EXPECT_GT(expected.size(), 6 * boxes.size());
    const Found found = searchTogether(boxes, psap::EveryPair{});
    EXPECT_EQ(found.pairs, expected);
    EXPECT_GT(found.mostAtOnce, 96u);  // three per lane
}

TEST(WarpSearch, FindsOnlyPairsThatEntryTestAccepts)
{
    SCOPED_TRACE("seed 2");
    Random random(2);
    const std::vector<Aabb> boxes = cubesIn(300, 0.41f, random);
    Pairs expected;
    for (const Pair& pair : everyPair(boxes))
    {
        const auto depth = [&] { return psap::overlapOf(boxes[pair.first], boxes[pair.second]); };
        if (ShallowAndEven{}({pair.first, pair.second}, depth))
            expected.push_back(pair);
    }
    EXPECT_GT(expected.size(), 300u);
    EXPECT_EQ(searchTogether(boxes, ShallowAndEven{}).pairs, expected);
}

// A group has records of several levels, and some boxes have no level.
TEST(WarpSearch, FindsPairsOfManySizes)
{
    SCOPED_TRACE("seed 3");
    Random random(3);
    std::vector<Aabb> boxes = boxesOfManySizes(500, 30, random);
    boxes.push_back(cube(-kInfinity, kInfinity));
    boxes.push_back(cube(2, kInfinity));
    boxes.push_back({{kNan, 0, 0}, {1, 1, 1}});
    boxes.push_back(cube(1, -1));
    const Pairs expected = everyPair(boxes);
    EXPECT_GT(expected.size(), 2000u);
    for (const float cell : {0.0f, 0.5f, 4.0f})
    {
        SCOPED_TRACE(cell);
        PsapOptions options;
        options.cellScale = cell;
        const Found found = searchTogether(boxes, psap::EveryPair{}, options);
        EXPECT_EQ(found.pairs, expected);
        EXPECT_GE(found.levels, 4u);
    }
}

// Boxes far apart in one group would have to test everything between them: the group searches in halves.
TEST(WarpSearch, SearchesInHalvesAroundHeap)
{
    SCOPED_TRACE("seed 4");
    Random random(4);
    std::vector<Aabb> boxes;
    for (int i = 0; i < 700; ++i)
        boxes.push_back(boxAt(random.point(14, 16), 0.1f));
    for (int i = 0; i < 200; ++i)
        boxes.push_back(boxAt(random.point(0, 30), 0.1f));
    const Found found = searchTogether(boxes, psap::EveryPair{});
    EXPECT_EQ(found.pairs, everyPair(boxes));
    EXPECT_GT(found.largestSum, 512u);
}

TEST(WarpSearch, SeesRegionsThatAreLongAlongAnyAxis)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        psap::Region region = psap::Region::emptyBox();
        Aabb box = boxAt(100, -200, 300);
        region.include(psap::recordOf(box, {0, 1, 2}, 0, 0));
        EXPECT_FALSE(region.isLongerThan(1.5f));
        box.min[axis] -= 1;
        box.max[axis] += 1;
        region.include(psap::recordOf(box, {0, 1, 2}, 1, 0));
        EXPECT_TRUE(region.isLongerThan(2.5f)) << axis;
        EXPECT_FALSE(region.isLongerThan(3.5f)) << axis;
    }
}

// Any plan and any order find the same pairs. After a change of the search insert the new numbers.
TEST(WarpSearch, MakesTheRecordedNumberOfTests)
{
    SCOPED_TRACE("seed 8");
    Random random(8);
    std::vector<Aabb> heap, sizes;
    for (int i = 0; i < 150; ++i)
        heap.push_back(boxAt(random.point(14, 16), 0.1f));
    for (int i = 0; i < 90; ++i)
        heap.push_back(boxAt(random.point(0, 30), 0.1f));
    for (int i = 0; i < 200; ++i)
    {
        const float half = random.logUniform(-5, 1);
        sizes.push_back(boxAt(random.point(0, 8), half));
    }
    sizes.push_back(boxAt(0, 0, 0, 1e20f));
    const std::vector<Aabb> even = cubesIn(160, 3, random, 4, 1, 2);
    std::vector<std::uint64_t> tests;
    for (const std::vector<Aabb>& boxes : {heap, sizes, even})
    {
        const Found found = searchTogether(boxes, psap::EveryPair{});
        EXPECT_EQ(found.pairs, everyPair(boxes));
        tests.push_back(found.tests);
    }
    EXPECT_EQ(tests, (std::vector<std::uint64_t>{9728, 10536, 3648}));
}

TEST(WarpSearch, FindsPairsOfFewIdenticalBoxes)
{
    for (const std::uint32_t count : {1u, 2u, 17u, 31u, 32u, 33u, 64u, 100u})
    {
        SCOPED_TRACE(count);
        const std::vector<Aabb> boxes(count, cube(1, 2));
        EXPECT_EQ(searchTogether(boxes, psap::EveryPair{}).pairs, everyPair(boxes));
    }
}

TEST(WarpSearch, CountsNoTestsOfRecordsWithThemselves)
{
    for (const std::uint32_t count : {1u, 2u, 5u})
    {
        const std::vector<Aabb> boxes(count, cube(1, 2));
        const PsapOptions options = inGroups();
        psap::HostExec exec(options);
        psap::CountingSearch<psap::HostExec> search(options, options.axis);
        EXPECT_EQ(findWith(exec, search, boxes, psap::EveryPair{}), everyPair(boxes));
        EXPECT_EQ(exec.collectTestCount(), count * (count - 1) / 2);
    }
}

TEST(WarpSearch, UsesShorterAxisAsFirstCellAxis)
{
    SCOPED_TRACE("seed 6");
    for (const std::uint32_t flat : {1u, 2u})
    {
        SCOPED_TRACE(flat);
        Random random(6);
        const std::vector<Aabb> boxes =
            cubesIn(3000, 3.6f, random, 10, flat == 1 ? 1.0f : 5.0f, flat == 2 ? 1.0f : 5.0f);
        const PsapOptions options = inGroups();
        psap::HostExec exec(options);
        psap::CountingSearch<psap::HostExec> search(options, options.axis);
        EXPECT_EQ(findWith(exec, search, boxes, psap::EveryPair{}), everyPair(boxes));
        const psap::LevelPlan& plan = *search.planner().plan();
        EXPECT_EQ(plan.axes.s, 0u);
        EXPECT_EQ(plan.axes.u, flat);
        EXPECT_EQ(plan.axes.v, 3 - flat);
        EXPECT_LT(2 * plan.levels[0].countU, plan.levels[0].countV);
    }
}

/// Lines of `boxesOfLine` boxes, `apart` from each other, in which each box overlaps the six after it.
std::vector<Aabb> lines(std::uint32_t count, std::uint32_t boxesOfLine, float apart)
{
    std::vector<Aabb> boxes;
    for (std::uint32_t i = 0; i < count; ++i)
        boxes.push_back(boxAt(static_cast<float>(i % boxesOfLine),
                              apart * static_cast<float>(i / boxesOfLine), 0, 3.25f));
    return boxes;
}

std::uint64_t pairsOfLines(std::uint32_t count, std::uint32_t boxesOfLine)
{
    return std::uint64_t{count / boxesOfLine} * (6 * boxesOfLine - 21);
}

/// @return whether the update could have repeated the recorded launches of the previous one
bool update(WatchedSearch& search, const std::vector<Aabb>& boxes, std::uint64_t expectedPairs,
            std::uint64_t pairs)
{
    const bool isRepeatable = search.isRepeatable(boxes, expectedPairs);
    EXPECT_EQ(search.find(boxes, expectedPairs).size(), pairs);
    return isRepeatable;
}

constexpr std::uint32_t kMany = (1u << 15) + 1;

// Otherwise launches recorded for boxes that search alone would be repeated for records in another order, in old
// memory.
TEST(WarpSearch, StartsAndStopsWithNewLaunchesAsPairCountChanges)
{
    const std::vector<Aabb> boxes = lines(kMany, kMany, 0);
    const std::uint64_t pairs = pairsOfLines(kMany, kMany);
    WatchedSearch search(PsapOrder::Counting);
    EXPECT_FALSE(update(search, boxes, 0, pairs));
    EXPECT_TRUE(update(search, boxes, 4 * kMany - 1, pairs));
    const std::uint32_t alone = search.launches();
    EXPECT_FALSE(update(search, boxes, 4 * kMany, pairs));
    const std::uint32_t together = search.launches();
    EXPECT_NE(together, alone);
    EXPECT_TRUE(update(search, boxes, 3 * kMany, pairs));  // no alternation at about four
    EXPECT_EQ(search.launches(), together);
    EXPECT_FALSE(update(search, boxes, 3 * kMany - 1, pairs));
    EXPECT_NE(search.launches(), together);
    EXPECT_NE(search.launches(), alone);
    EXPECT_TRUE(update(search, boxes, 0, pairs));
}

TEST(WarpSearch, IsNotUsedForManyPairsOfOnly32768Boxes)
{
    const std::vector<Aabb> boxes = lines(kMany - 1, kMany - 1, 0);
    const std::uint64_t pairs = pairsOfLines(kMany - 1, kMany - 1);
    WatchedSearch search(PsapOrder::Counting);
    update(search, boxes, 0, pairs);
    EXPECT_TRUE(update(search, boxes, 9 * kMany, pairs));
}

TEST(WarpSearch, IsUsedForManySizesOnlyFrom32768BoxesOn)
{
    SCOPED_TRACE("seed 5");
    constexpr std::uint32_t kLeast = 1u << 15;
    for (const std::uint32_t count : {kLeast - 1, kLeast})
    {
        SCOPED_TRACE(count);
        Random random(5);
        const std::vector<Aabb> boxes = boxesOfManySizes(count, 120, random);
        WatchedSearch search(PsapOrder::Counting);
        const std::uint64_t pairs = search.find(boxes).size();
        EXPECT_GT(pairs, count);
        EXPECT_EQ(update(search, boxes, 0, pairs), count < kLeast);
        EXPECT_TRUE(update(search, boxes, 0, pairs));
    }
}

// Cells of the mean distance would hold many boxes each.
TEST(WarpSearch, IsNotUsedWhenHeapsAreFarApart)
{
    for (const float apart : {20.0f, 1e6f})
    {
        SCOPED_TRACE(apart);
        constexpr std::uint32_t kCount = 1u << 16;
        const std::vector<Aabb> boxes = lines(kCount, 256, apart);
        const std::uint64_t pairs = pairsOfLines(kCount, 256);
        WatchedSearch search(PsapOrder::Counting);
        update(search, boxes, 0, pairs);
        EXPECT_EQ(update(search, boxes, pairs, pairs), apart > 1000);
    }
}
}  // namespace
}  // namespace cullet::test
