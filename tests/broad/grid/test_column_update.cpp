// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The sweep mode of the column grid where it keeps its columns from update to update, and its helpers.

#include "cullet/broad/grid/column_grid_backend.h"
#include "cullet/broad/grid/update/mode_policy.h"
#include "cullet/broad/limits.h"
#include "cullet/broad/pairs/pair_sort.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"
#include "cullet/tests/support/random_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
GridOptions alwaysMoving(int threads, bool baseline)
{
    GridOptions options;
    options.threads = threads;
    options.baselineSimd = baseline;
    options.settles = false;
    return options;
}

/// All boxes drift; none teleports, is created or destroyed.
RandomWorldOptions driftingWorld()
{
    RandomWorldOptions options;
    options.count = 500;
    options.halfSide = 8.0f;
    options.sizeHigh = 1;
    options.move = 0.9f;
    options.stride = 0.125f;
    options.teleport = options.resize = options.refilter = options.destroy = options.special = 0;
    return options;
}

struct FollowCase
{
    const char* name;
    GridOptions options;
    float shift;
    bool isSnapped;
};

std::ostream& operator<<(std::ostream& out, const FollowCase& followCase)
{
    return out << followCase.name;
}

class ColumnUpdate : public testing::TestWithParam<FollowCase>
{
protected:
    /// driftingWorld() with the parameters of the case.
    static RandomWorldOptions drifting()
    {
        RandomWorldOptions options = driftingWorld();
        for (float& coordinate : options.shift)
            coordinate = GetParam().shift;
        options.isSnapped = GetParam().isSnapped;
        return options;
    }
};

TEST_P(ColumnUpdate, MatchesOracleInDriftingWorldWithBurstsOfEvents)
{
    BackendSession session{std::make_unique<ColumnGridBackend>(GetParam().options)};
    session.margin = 0.0625f;
    RandomWorld world(21, drifting(), session.table);
    std::map<std::string, int> paths;
    for (int step = 0; step < 120; ++step)
    {
        SCOPED_TRACE("seed 21, step " + std::to_string(step));
        // Single teleports, changes of filter words, and steps with many events.
        const bool isStirred = step % 12 == 7;
        world.options.teleport = step % 5 == 3 ? 0.004f : 0.0f;
        world.options.refilter = step % 17 == 11 ? 0.02f : 0.0f;
        world.options.destroy = world.options.special = isStirred ? 0.05f : 0.0f;
        world.step();
        ASSERT_TRUE(session.step());
        ++paths[session.backend().stats().path];
    }
    EXPECT_GT(paths["follow"], 60);
    EXPECT_GT(paths["rebuild"], 5);
    EXPECT_GT(session.addedTotal(), 2000u);
    EXPECT_GT(session.removedTotal(), 2000u);
    EXPECT_GT(world.counts().teleported, 20u);
    EXPECT_GT(world.counts().refiltered, 20u);
    EXPECT_GT(world.counts().destroyed, 50u);
}

TEST_P(ColumnUpdate, MatchesOracleWhenMotionsAreUneven)
{
    BackendSession session{std::make_unique<ColumnGridBackend>(GetParam().options)};
    session.margin = 0.0625f;
    RandomWorld world(26, drifting(), session.table);
    std::map<std::string, int> paths;
    for (int step = 0; step < 120; ++step)
    {
        SCOPED_TRACE("seed 26, step " + std::to_string(step));
        // Few boxes move, then all; then single boxes teleport, which a motion bound per box does not cover.
        world.options.move = step % 16 < 12 ? 0.15f : 1.0f;
        world.options.stride = step % 7 == 3 ? 0.5f : 0.125f;
        world.options.teleport = step % 16 == 6 ? 0.004f : 0.0f;
        world.step();
        ASSERT_TRUE(session.step());
        ++paths[session.backend().stats().path];
    }
    EXPECT_GT(paths["follow"], 60);
    EXPECT_GT(session.addedTotal(), 1000u);
    EXPECT_GT(session.removedTotal(), 1000u);
    EXPECT_GT(world.counts().teleported, 5u);
}

TEST_P(ColumnUpdate, MatchesOracleWhenMostBoxesAreTeleported)
{
    GridOptions gridOptions = GetParam().options;
    gridOptions.cellScale = 1;  // cells so narrow that every teleport exceeds them
    BackendSession session{std::make_unique<ColumnGridBackend>(gridOptions)};
    RandomWorld world(25, drifting(), session.table);
    std::map<std::string, int> reasons;
    for (int step = 0; step < 120; ++step)
    {
        SCOPED_TRACE("seed 25, step " + std::to_string(step));
        // Series of teleports, alone and among events, with calm updates and single teleports between them; margins
        // that keep pairs across a teleport.
        const bool isJump = step % 16 < 7;
        session.margin = step % 32 < 16 ? 0.0625f : 1.0f;
        world.options.teleport = isJump ? 0.8f : step % 5 == 3 ? 0.004f : 0.0f;
        world.options.refilter = step % 17 == 11 ? 0.05f : 0.0f;
        world.options.destroy = world.options.special = step % 7 == 3 ? 0.05f : 0.0f;
        world.step();
        ASSERT_TRUE(session.step());
        ++reasons[session.backend().stats().decision.reason];
    }
    EXPECT_GT(reasons["most boxes jumped"], 30);
    EXPECT_GT(reasons["few boxes came into other cells"], 20);
    EXPECT_GT(session.addedTotal(), 20000u);
    EXPECT_GT(session.removedTotal(), 20000u);
    EXPECT_GT(world.counts().refiltered, 20u);
    EXPECT_GT(world.counts().destroyed, 50u);
}

INSTANTIATE_TEST_SUITE_P(Grids, ColumnUpdate,
                         testing::Values(FollowCase{"OneThread", alwaysMoving(1, false), 0, true},
                                         FollowCase{"TwoThreads", alwaysMoving(2, false), 0, true},
                                         FollowCase{"Baseline", alwaysMoving(1, true), 0, true},
                                         FollowCase{"NotSnapped", alwaysMoving(1, false), 0, false},
                                         FollowCase{"FarAway", alwaysMoving(1, false), 3e5f, false}),
                         [](const auto& test) { return test.param.name; });

/// Updates two backends, which must report the same delta. @return the number of removed pairs
std::size_t updateBoth(Backend& one, Backend& other, ProxyTable& table)
{
    const ProxyView view = table.beginUpdate(0.0625f, true);
    PairDelta a;
    PairDelta b;
    EXPECT_EQ(one.update(view, a), Status::Ok);
    EXPECT_EQ(other.update(view, b), Status::Ok);
    table.endUpdate();
    EXPECT_EQ(a.added, b.added);
    EXPECT_EQ(a.removed, b.removed);
    return a.removed.size();
}

TEST(ColumnUpdate, FollowsBoxesAtTheLargestFloat)
{
    constexpr float kLargest = std::numeric_limits<float>::max();
    BackendSession session(std::make_unique<ColumnGridBackend>(alwaysMoving(1, false)));
    Random random(23);
    std::vector<ProxyId> rows;
    for (int i = 0; i < 200; ++i)
    {
        Aabb box = boxAt(random.point(0, 12));
        box.min[0] = box.max[0] = i % 2 == 0 ? kLargest : -kLargest;
        rows.push_back(session.add(box));
    }
    for (int step = 0; step < 8; ++step)
    {
        ASSERT_TRUE(session.step());
        for (const ProxyId row : rows)
            session.table.setBox(row, translated(session.table.box(row), 0, random.between(-0.05f, 0.05f),
                                                 random.between(-0.05f, 0.05f)));
    }
    EXPECT_STREQ(session.backend().stats().path, "follow");
    EXPECT_GT(session.addedTotal() + session.removedTotal(), 200u);
}

TEST(ColumnUpdate, ReportsSameDeltasWithOneAndFourThreadsWhenMostBoxesMove)
{
    RandomWorldOptions options = driftingWorld();
    options.count = 20000;
    options.halfSide = 30.0f;
    ProxyTable table;
    RandomWorld world(22, options, table);
    ColumnGridBackend one(alwaysMoving(1, true));
    ColumnGridBackend four(alwaysMoving(4, false));
    std::size_t changes = 0;
    for (int step = 0; step < 6; ++step)
    {
        changes += updateBoth(one, four, table);
        world.step();
    }
    EXPECT_STREQ(four.stats().path, "follow");
    EXPECT_GT(changes, 1000u);
}

TEST(ColumnUpdate, ReportsSameDeltasWithOneAndFourThreadsWhenTenthIsAwake)
{
    GridOptions options;
    options.rebuildFraction = 1;  // enters the resting mode at once, and stays in it
    options.threads = 1;
    ColumnGridBackend one(options);
    options.threads = 4;
    ColumnGridBackend four(options);
    ProxyTable table;
    Random random(27);
    std::vector<Aabb> boxes;
    for (std::uint32_t i = 0; i < 30000; ++i)
    {
        Aabb box;
        for (int axis = 0; axis < 3; ++axis)
        {
            box.min[axis] = random.between(0.0f, 40.0f);
            box.max[axis] = box.min[axis] + 1.0f;
        }
        boxes.push_back(box);
        table.create(box, i + 1, {1, -1});
    }
    std::size_t changes = 0;
    for (int step = 0; step < 24; ++step)
    {
        SCOPED_TRACE("seed 27, step " + std::to_string(step));
        changes += updateBoth(one, four, table);
        // A tenth moves, so that the others rest and more boxes are awake than one thread processes; at times others
        // move, too.
        for (std::uint32_t row = step % 8 == 6 ? 5 : 0; row < table.size(); row += 10)
        {
            boxes[row].min[step % 3] += 0.25f;
            boxes[row].max[step % 3] += 0.25f;
            table.setBox(row, boxes[row]);
        }
    }
    EXPECT_STREQ(four.stats().path, "incremental");
    EXPECT_GT(changes, 1000u);
}

/// Updates a grid of boxes of size 1 in a cube and a single box of size 64, all moved by `stride` between updates.
BackendStats statsOfMotion(GridOptions options, float stride, int updates)
{
    options.threads = 1;
    ColumnGridBackend grid(options);
    ProxyTable table;
    Random random(24);
    std::vector<Aabb> boxes;
    for (std::uint32_t i = 0; i < 3000; ++i)
    {
        const float size = i == 0 ? 64.0f : 1.0f;
        Aabb box;
        for (int axis = 0; axis < 3; ++axis)
        {
            box.min[axis] = random.between(0.0f, 40.0f);
            box.max[axis] = box.min[axis] + size;
        }
        boxes.push_back(box);
        table.create(box, i + 1, {1, -1});
    }
    PairDelta delta;
    for (int update = 0; update < updates; ++update)
    {
        EXPECT_EQ(grid.update(table.beginUpdate(0.0625f, false), delta), Status::Ok);
        table.endUpdate();
        for (std::uint32_t i = 0; i < boxes.size(); ++i)
        {
            const float shift = random.between(-stride, stride);
            for (int axis = 0; axis < 3; ++axis)
            {
                boxes[i].min[axis] += shift;
                boxes[i].max[axis] += shift;
            }
            table.setBox(i, boxes[i]);
        }
    }
    return grid.stats();
}

TEST(GridDecision, TakesCheaperPathAndReportsReason)
{
    const BackendStats drifting = statsOfMotion({}, 0.1f, 6);
    EXPECT_STREQ(drifting.path, "follow");
    EXPECT_STREQ(drifting.decision.reason, "few boxes came into other cells");
    EXPECT_GT(drifting.decision.strays, 0u);
    EXPECT_LT(drifting.decision.cost, drifting.decision.otherCost);

    const BackendStats jumping = statsOfMotion({}, 30.0f, 6);
    EXPECT_STREQ(jumping.path, "rebuild");
    EXPECT_STREQ(jumping.decision.reason, "most boxes jumped");
    EXPECT_LT(jumping.decision.cost, jumping.decision.otherCost);

    GridOptions wide;
    wide.cellScale = 16;
    const BackendStats straying = statsOfMotion(wide, 4.0f, 6);
    EXPECT_STREQ(straying.path, "rebuild");
    EXPECT_STREQ(straying.decision.reason, "many boxes came into other cells");
    EXPECT_GT(straying.decision.strays, 3000u / 5);
    EXPECT_LT(straying.decision.cost, straying.decision.otherCost);

    const BackendStats resting = statsOfMotion({}, 0.001f, 12);
    EXPECT_STREQ(resting.path, "watch");
    EXPECT_STREQ(resting.decision.reason, "most boxes rest");
    EXPECT_EQ(resting.decision.strays, 0u);
    EXPECT_LT(resting.decision.cost, resting.decision.otherCost);
}

/// Number of updates in resting mode out of 30, in each of which a twentieth of the boxes moves: the same or the next
/// one.
int restingUpdatesOf(bool isFresh)
{
    constexpr std::uint32_t kCount = 5000;
    constexpr std::uint32_t kShares = 20;
    ColumnGridBackend grid{GridOptions()};
    ProxyTable table;
    Random random(28);
    for (std::uint32_t i = 0; i < kCount; ++i)
        table.create(boxAt(random.point(0, 40)), i + 1, {1, -1});
    PairDelta delta;
    int settled = 0;
    for (std::uint32_t update = 0; update < 30; ++update)
    {
        EXPECT_EQ(grid.update(table.beginUpdate(0.0625f, false), delta), Status::Ok);
        table.endUpdate();
        settled += grid.stats().path == std::string("incremental") ? 1 : 0;
        for (std::uint32_t row = isFresh ? update % kShares : 0; row < kCount; row += kShares)
            table.setBox(row, translated(table.box(row), 0.125f, 0, 0));
    }
    return settled;
}

TEST(GridDecision, EntersRestingModeOnlyWhenSameBoxesKeepMoving)
{
    EXPECT_GT(restingUpdatesOf(false), 24);
    EXPECT_EQ(restingUpdatesOf(true), 0);
}

TEST(GridDecision, ChoosesPlanNoDearerThanItsAlternatives)
{
    const BackendStats stats = statsOfMotion({}, 0.1f, 2);
    EXPECT_GT(stats.decision.cellWidth, 0.0f);
    EXPECT_GT(stats.decision.planCost, 0.0);
    EXPECT_LE(stats.decision.planCost, stats.decision.oneLevelCost);
    EXPECT_LE(stats.decision.planCost, stats.decision.allLevelsCost);
}

TEST(GridDecision, KeepsChoicesFixedByOptions)
{
    GridOptions options;
    options.levels = 2;
    EXPECT_EQ(statsOfMotion(options, 0.1f, 2).levels, 2u);
    options.levels = 1;
    EXPECT_EQ(statsOfMotion(options, 0.1f, 2).levels, 1u);
    options.rebuildFraction = 0;
    EXPECT_STREQ(statsOfMotion(options, 0.001f, 12).path, "rebuild");
    options = GridOptions();
    options.settles = false;
    EXPECT_STREQ(statsOfMotion(options, 0.001f, 12).path, "follow");
}

/// Fills lists with keys of one distribution; the first keys are added twice, which removes them.
Pairs fillLists(Random& random, std::uint32_t ids, std::uint32_t firsts, std::size_t count,
                std::vector<KeyList>& lists)
{
    std::vector<std::uint64_t> keys;
    for (std::size_t i = 0; i < count; ++i)
    {
        const std::uint64_t first = ids - 1 - random.below(firsts);
        keys.push_back(first << 32 | random.below(ids));
    }
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    const std::size_t twice = keys.size() / 3;
    Pairs expected(keys.size() - twice);
    std::transform(keys.begin() + static_cast<std::ptrdiff_t>(twice), keys.end(), expected.begin(),
                   pairOfKey);
    keys.insert(keys.end(), keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(twice));
    for (KeyList& list : lists)
        list.clear();
    for (std::size_t i = keys.size(); i > 0; --i)
    {
        std::swap(keys[i - 1], keys[random.below(static_cast<std::uint32_t>(i))]);
        lists[random.below(static_cast<std::uint32_t>(lists.size()))].push(keys[i - 1]);
    }
    return expected;
}

TEST(PairSort, SortsListsAndRemovesKeysThatOccurTwice)
{
    Random random(26);
    PairSort sort;
    for (const int threads : {1, 3})
    {
        ParallelLoops workers(threads);
        std::vector<KeyList> lists(static_cast<std::size_t>(threads));
        for (const std::size_t count : {0u, 1u, 30u, 1000u, 40000u, 150000u})
        {
            for (const std::uint32_t ids : {300u, 70000u, 0xffffffffu})
            {
                for (const std::uint32_t firsts : {1u, 200u, ids})
                {
                    const Pairs expected = fillLists(random, ids, firsts, count, lists);
                    Pairs pairs(3);
                    sort.write(workers, lists, pairs);
                    EXPECT_EQ(pairs, expected)
                        << threads << " threads, " << count << " keys, ids below " << ids;
                }
            }
        }
    }
}

TEST(Limits, RefuseWhatRowsAndKeysCannotCount)
{
    EXPECT_EQ(extendableRows(kMostRows - 1), kMostRows - 1);
    EXPECT_THROW(extendableRows(kMostRows), std::bad_alloc);
    EXPECT_EQ(sortableCount(0), 0u);
    EXPECT_EQ(sortableCount(0xffffffffu), 0xffffffffu);
    EXPECT_THROW(sortableCount(0x100000000u), std::bad_alloc);
    EXPECT_THROW(sortableCount(~std::uint64_t{0}), std::bad_alloc);
}

TEST(PairSort, TakesListsInOrderWithoutSort)
{
    PairSort sort;
    ParallelLoops workers(2);
    std::vector<KeyList> lists(2);
    Pairs expected;
    for (std::uint32_t i = 0; i < 50000; ++i)
    {
        expected.push_back({1 + i / 2, 70000 + i});
        lists[i / 25000].push(pairKey(expected.back()));
    }
    Pairs pairs;
    sort.write(workers, lists, pairs);
    EXPECT_EQ(pairs, expected);
    EXPECT_EQ(sort.bytes(), 0u) << "has sorted a copy";
    // Duplicates, one in each list.
    lists[1].push(pairKey(expected[7]));
    expected.erase(expected.begin() + 7);
    sort.write(workers, lists, pairs);
    EXPECT_EQ(pairs, expected);
    EXPECT_GT(sort.bytes(), 8 * expected.size());
}

TEST(PairSort, EqualsSortingByComparisons)
{
    Random random(23);
    PairSort sort;
    for (const std::size_t count : {0u, 1u, 2u, 383u, 384u, 5000u})
    {
        for (const std::uint32_t ids : {2u, 300u, 70000u, 0xffffffffu})
        {
            std::vector<std::uint64_t> keys(count);
            for (std::uint64_t& key : keys)
            {
                key = std::uint64_t{random.below(ids)} << 32;
                key |= ids - 1 - random.below(ids);
            }
            Pairs expected(count);
            std::transform(keys.begin(), keys.end(), expected.begin(), pairOfKey);
            std::sort(expected.begin(), expected.end());
            Pairs pairs(3);
            sort.write(keys, pairs);
            EXPECT_EQ(pairs, expected) << count << " keys, ids below " << ids;
        }
    }
}

TEST(PairSort, CopiesKeysOfOneThreadThatAreInOrder)
{
    PairSort sort;
    Pairs expected, pairs;
    std::vector<std::uint64_t> keys;
    for (std::uint32_t i = 0; i < 5000; ++i)
    {
        expected.push_back({1 + i / 2, 70000 + i});
        keys.push_back(pairKey(expected.back()));
    }
    sort.write(keys, pairs);
    EXPECT_EQ(pairs, expected);
    EXPECT_EQ(sort.bytes(), 0u) << "has sorted a copy";
    std::swap(keys[17], keys[4000]);
    sort.write(keys, pairs);
    EXPECT_EQ(pairs, expected);
    EXPECT_GE(sort.bytes(), 8 * expected.size());
}

TEST(ModePolicy, WaitsLongerEachTimeThatRestingModeDidNotPay)
{
    ModePolicy policy;
    for (const std::uint32_t wait : {32u, 64u, 128u, 256u, 256u})
    {
        ASSERT_TRUE(policy.mayBegin());
        policy.begin(1000);
        policy.count(200, 0);
        policy.end();
        for (std::uint32_t i = 0; i < wait; ++i, policy.countMoving())
            ASSERT_FALSE(policy.mayBegin()) << i << " of " << wait;
    }
    policy.begin(1000);
    for (int i = 0; i < 100; ++i)
        policy.count(10, 50);
    policy.end();
    EXPECT_TRUE(policy.mayBegin()) << "that one paid";
}
}  // namespace
}  // namespace cullet::test
