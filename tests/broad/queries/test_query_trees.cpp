// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/broad/queries/query_checks.h"

#include <gtest/gtest.h>

#include <cmath>

namespace cullet::test
{
namespace
{
TEST(QueryIndex, ScansForFewQueriesAndBuildsTreeForMany)
{
    ProxyTable table;
    const QueryIndex index(table);
    for (std::uint32_t i = 0; i < 5000; ++i)
        table.create(cube(3.0f * i, 0, 0, 1), i + 1, kFilter);
    overlapping(table, index, cube(0, 0, 0, 1));
    EXPECT_EQ(index.syncsTotal(), 0u);
    for (int i = 0; i < 1000; ++i)
        overlapping(table, index, cube(0, 0, 0, 1));
    EXPECT_EQ(index.syncsTotal(), 1u);
    table.setBox(1, cube(1.5f, 0, 0, 1));
    // Updating the tree for one moved box is cheaper than scanning all boxes once or twice.
    for (int i = 0; i < 3; ++i)
        EXPECT_EQ(overlapping(table, index, cube(0, 0, 0, 1)).size(), 2u);
    EXPECT_EQ(index.syncsTotal(), 2u);
    EXPECT_EQ(index.buildsTotal(), 1u);
}

TEST(QueryIndex, BuildsNewTreeWhenRowsWanderOff)
{
    ProxyTable table;
    const QueryIndex index(table, {QueryMode::Tree, false});
    QueryRandom random(15);
    for (std::uint32_t i = 0; i < 4000; ++i)
        table.create(anyCube(random, 0, 40, 0.5f), i + 1, kFilter);
    for (int step = 0; step < 60; ++step)
    {
        for (ProxyId row = 0; row < table.size(); ++row)
        {
            Aabb box = table.box(row);
            const int axis = static_cast<int>(row % 3);
            const float shift = row % 2 == 0 ? 0.4f : -0.4f;
            box.min[axis] += shift;
            box.max[axis] += shift;
            table.setBox(row, box);
        }
        const Aabb query = cube(20, 20, 20, 4);
        ASSERT_EQ(overlapping(table, index, query), overlappingByBruteForce(table, query));
    }
    EXPECT_GT(index.buildsTotal(), 2u);
    EXPECT_LT(index.buildsTotal(), 20u);
}

TEST(QueryIndex, FindsBoxesThatMoveOneByOneWithFewExtraCandidates)
{
    ProxyTable table;
    const QueryIndex index(table, {QueryMode::Tree, false});
    QueryRandom random(16);
    for (std::uint32_t i = 0; i < 500; ++i)
        table.create(anyCube(random, 0, 14, 0.5f), i + 1, kFilter);
    std::size_t candidates = 0, found = 0;
    for (std::uint32_t step = 0; step < 6000; ++step)
    {
        const ProxyId row = step % table.size();
        Aabb box = table.box(row);
        // Small steps; at times a box shrinks to a tenth in place, or teleports.
        const std::uint32_t kind = random.below(50);
        if (kind == 0 && box.max[0] - box.min[0] > 0.5f)
            box = cube(box.min[0] + 0.2f, box.min[1] + 0.2f, box.min[2] + 0.2f, 0.05f);
        else if (kind == 1)
            box = anyCube(random, 0, 14, 0.5f);
        else
            box.min[row % 3] += 0.05f, box.max[row % 3] += 0.05f;
        table.setBox(row, box);
        const std::vector<ProxyId> expected = overlappingByBruteForce(table, box);
        ASSERT_EQ(overlapping(table, index, box), expected) << "step " << step;
        found += expected.size();
        index.forEachOverlap(box, [&](ProxyId) { ++candidates; });
    }
    EXPECT_GT(found, 2u * 6000u) << "hardly any box meets another";
    RecordProperty("candidates", std::to_string(candidates) + " for " + std::to_string(found));
    EXPECT_LT(candidates, found + found / 4);
}

/// Rows tested by queries and inserted into trees, not counting the descent of trees.
struct Work
{
    explicit Work(const QueryIndex& index_)
        : index(index_), scanned(index.scannedRowsTotal()), built(index.builtRowsTotal())
    {
    }
    double scannedPer(std::uint32_t queries) const
    {
        return static_cast<double>(index.scannedRowsTotal() - scanned) / queries;
    }
    double builtPer(std::uint32_t queries) const
    {
        return static_cast<double>(index.builtRowsTotal() - built) / queries;
    }

    const QueryIndex& index;
    std::uint64_t scanned;
    std::uint64_t built;
};

Aabb cubeInCrowd(QueryRandom& random)
{
    return anyCube(random, 0, 60, 0.5f);
}

std::vector<ProxyId> fillCrowd(ProxyTable& table, std::uint32_t count, QueryRandom& random)
{
    std::vector<ProxyId> rows;
    for (std::uint32_t i = 0; i < count; ++i)
        rows.push_back(table.create(cubeInCrowd(random), i + 1, kFilter));
    return rows;
}

void ask(const QueryIndex& index, QueryRandom& random, std::uint32_t times)
{
    for (std::uint32_t i = 0; i < times; ++i)
        index.forEachOverlap(cubeInCrowd(random), [](ProxyId) {});
}

constexpr std::uint32_t kCrowd = 30000;

/// Calls change(i) `count` times, with a query after each, and expects no scan of all boxes.
template <class Change>
void expectFewTestsAfterEach(const QueryIndex& index, QueryRandom& random, const Change& change)
{
    const Work work(index);
    for (std::uint32_t i = 0; i < kCrowd; ++i)
    {
        change(i);
        ask(index, random, 1);
    }
    EXPECT_LT(work.scannedPer(kCrowd), 400.0);
    EXPECT_LT(work.builtPer(kCrowd), 40.0);
}

TEST(QueryIndex, TestsFewBoxesInQueryAfterEachAddedBox)
{
    ProxyTable table;
    const QueryIndex index(table);
    QueryRandom random(17);
    expectFewTestsAfterEach(index, random,
                            [&](std::uint32_t i) { table.create(cubeInCrowd(random), i + 1, kFilter); });
}

TEST(QueryIndex, TestsFewBoxesInQueryAfterEachTeleportedBox)
{
    ProxyTable table;
    const QueryIndex index(table);
    QueryRandom random(18);
    fillCrowd(table, kCrowd, random);
    ask(index, random, 1000);
    expectFewTestsAfterEach(index, random,
                            [&](std::uint32_t)
                            {
                                const Aabb box = cubeInCrowd(random);
                                table.setBox(random.below(kCrowd), box);
                            });
}

TEST(QueryIndex, DoesNotRebuildTreeRepeatedlyWhenFewBoxesCrossWorld)
{
    constexpr std::uint32_t kRows = 30000;
    ProxyTable table;
    const QueryIndex index(table);
    QueryRandom random(19);
    fillCrowd(table, kRows, random);
    ask(index, random, 1000);
    const Work work(index);
    constexpr std::uint32_t kSteps = 30;
    for (std::uint32_t i = 0; i < 4000; ++i)
    {
        // The box accelerates, so that its leaf grows with it.
        const ProxyId row = 100 * (i / kSteps);
        Aabb box = table.box(row);
        for (int axis = 0; axis < 2; ++axis)
        {
            const float step = 0.3f * std::pow(1.3f, static_cast<float>(i % kSteps));
            box.min[axis] += step;
            box.max[axis] += step;
        }
        table.setBox(row, box);
        ask(index, random, 1);
    }
    EXPECT_LT(work.scannedPer(4000), 400.0);
    EXPECT_LT(work.builtPer(4000), 200.0);
    EXPECT_GT(work.builtPer(4000) * 4000, kRows) << "no leaf grew too large";
}

TEST(QueryIndex, FindsRowTeleportedTwiceWhenAllOthersAreSetAgain)
{
    ProxyTable table;
    const QueryIndex index(table, {QueryMode::Tree, false});
    QueryRandom random(23);
    const std::vector<ProxyId> rows = fillCrowd(table, 2000, random);
    ask(index, random, 1);
    table.setBox(7, cubeInCrowd(random));
    ask(index, random, 1000);
    EXPECT_EQ(index.buildsTotal(), 1u);
    EXPECT_EQ(index.builtRowsTotal(), 2001u) << "the row that jumped is in no tree of its own";
    for (const ProxyId row : rows)
        table.setBox(row, table.box(row));
    const Aabb box = cubeInCrowd(random);
    table.setBox(7, box);
    EXPECT_EQ(overlapping(table, index, box), overlappingByBruteForce(table, box));
    EXPECT_EQ(index.buildsTotal(), 1u);
}

TEST(QueryIndex, KeepsUnboundedRowsOutOfTreesUntilTheyAreBounded)
{
    constexpr std::uint32_t kPlanes = 300;
    ProxyTable table;
    const QueryIndex index(table, {QueryMode::Tree, false});
    QueryRandom random(24);
    fillCrowd(table, 1000, random);
    for (std::uint32_t i = 0; i < kPlanes; ++i)
        table.create({{-kInf, -kInf, -kInf}, {kInf, 0, kInf}}, 2000 + i, kFilter);
    ask(index, random, 1);
    for (ProxyId row = 0; row < 20; ++row)
    {
        table.setBox(row, cubeInCrowd(random));
        ask(index, random, 200);
    }
    EXPECT_EQ(index.buildsTotal(), 1u) << "listed for good, they are no reason for a new tree";
    const std::uint64_t built = index.builtRowsTotal();
    for (std::uint32_t i = 0; i < kPlanes; ++i)
        table.setBox(1000 + i, cubeInCrowd(random));
    ask(index, random, 200);
    EXPECT_GE(index.builtRowsTotal() - built, kPlanes);
    EXPECT_EQ(overlapping(table, index, table.box(1007)), overlappingByBruteForce(table, table.box(1007)));
}

TEST(QueryIndex, BuildsTreeOfTeleportedRowsAfterManyQueriesWithoutChanges)
{
    ProxyTable table;
    const QueryIndex index(table);
    QueryRandom random(20);
    fillCrowd(table, 20000, random);
    ask(index, random, 1000);
    for (ProxyId row = 0; row < 200; ++row)
        table.setBox(row, cubeInCrowd(random));
    ask(index, random, 1);
    const std::uint64_t syncs = index.syncsTotal();
    const Work work(index);
    ask(index, random, 20000);
    EXPECT_EQ(index.syncsTotal(), syncs);
    EXPECT_LT(work.scannedPer(20000), 2.0);
    EXPECT_LE(work.builtPer(20000) * 20000, 200.0);
    EXPECT_EQ(overlapping(table, index, table.box(7)), overlappingByBruteForce(table, table.box(7)));
}

TEST(QueryIndex, SpendsNothingOnRowsWithoutProxyAfterPeak)
{
    constexpr std::uint32_t kPeak = 100000;
    ProxyTable table;
    const QueryIndex index(table);
    QueryRandom random(21);
    const std::vector<ProxyId> rows = fillCrowd(table, kPeak, random);
    for (std::uint32_t i = 100; i < kPeak; ++i)
        table.destroy(rows[i]);
    table.beginUpdate(0.0f, false);
    table.endUpdate();
    const Work work(index);
    for (std::uint32_t i = 0; i < 4000; ++i)
    {
        table.setBox(rows[i % 100], cubeInCrowd(random));
        ask(index, random, 1);
        const Aabb box = table.box(rows[random.below(100)]);
        if (i % 100 == 0)
        {
            ASSERT_EQ(overlapping(table, index, box), overlappingByBruteForce(table, box));
        }
    }
    EXPECT_LT(work.scannedPer(4000), 200.0);
    EXPECT_LT(work.builtPer(4000), 40.0);
}

/// Makes a change of any kind to one row: rows are created, destroyed and reused, move, teleport, become empty and
/// valid again, and leave the bounds of every tree.
void changeOne(ProxyTable& table, std::vector<ProxyId>& live, std::uint32_t& nextId, QueryRandom& random)
{
    const std::uint32_t kind = random.below(12);
    if (kind < 2)
    {
        live.push_back(table.create(kind == 0 ? randomBox(random) : cubeInCrowd(random), nextId++, kFilter));
        return;
    }
    const std::uint32_t at = random.below(static_cast<std::uint32_t>(live.size()));
    const ProxyId row = live[at];
    if (kind < 4)
    {
        table.destroy(row);
        live[at] = live.back();
        live.pop_back();
    }
    else if (kind == 4)
    {
        table.setBox(row, randomBox(random));
    }
    else if (kind < 7)
    {
        table.setBox(row, cubeInCrowd(random));
    }
    else
    {
        Aabb box = table.box(row);
        const float shift = random.uniform(-1.0f, 1.0f);
        box.min[kind % 3] += shift;
        box.max[kind % 3] += shift;
        table.setBox(row, box);
    }
}

TEST(QueryIndex, EqualsBruteForceBetweenSingleChanges)
{
    for (const QueryOptions& options : kAllOptions)
    {
        ProxyTable table;
        const QueryIndex index(table, options);
        QueryRandom random(22);
        std::vector<ProxyId> live = fillCrowd(table, 1500, random);
        std::uint32_t nextId = 2000;
        std::size_t hits = 0;
        std::uint32_t quietBuilds = 0;  // trees built between two changes, for the list
        for (int step = 0; step < 4000; ++step)
        {
            for (std::uint32_t i = random.below(3); i > 0; --i)
                changeOne(table, live, nextId, random);
            if (step % 500 == 250)
            {
                for (const ProxyId row : live)
                    table.setBox(row, random.below(4) == 0 ? cubeInCrowd(random) : table.box(row));
            }
            const std::uint64_t built = index.builtRowsTotal(), syncs = index.syncsTotal();
            for (std::uint32_t i = step % 50 == 0 ? 100 : 1 + random.below(2); i > 0; --i)
            {
                Aabb box = random.below(8) == 0 ? randomBox(random) : cubeInCrowd(random);
                box.max[0] += 20.0f, box.max[1] += 3.0f;
                const std::vector<ProxyId> expected = overlappingByBruteForce(table, box);
                ASSERT_EQ(overlapping(table, index, box), expected) << "step " << step;
                hits += expected.size();
            }
            quietBuilds += index.builtRowsTotal() != built && index.syncsTotal() == syncs ? 1 : 0;
            const std::uint64_t before = index.syncsTotal(), builtBefore = index.builtRowsTotal();
            RayCount rays;
            checkRay(table, index, randomRay(random), rays);
            ASSERT_FALSE(HasFatalFailure()) << "step " << step;
            quietBuilds += index.builtRowsTotal() != builtBefore && index.syncsTotal() == before ? 1 : 0;
            if (random.below(20) == 0)
            {
                table.beginUpdate(0.0f, false);
                table.endUpdate();
            }
        }
        EXPECT_GT(hits, 20000u);
        EXPECT_EQ(index.syncsTotal() > 1000, options.mode != QueryMode::Scan);
        EXPECT_EQ(index.buildsTotal() > 5, options.mode != QueryMode::Scan);
        EXPECT_EQ(quietBuilds > 10, options.mode != QueryMode::Scan) << quietBuilds;
    }
}

TEST(QueryIndex, UsesLessThanSixtyBytesPerRow)
{
    ProxyTable table;
    const QueryIndex index(table, {QueryMode::Tree, false});
    for (std::uint32_t i = 0; i < 50000; ++i)
        table.create(cube(3.0f * (i % 300), 3.0f * (i / 300), 0, 1), i + 1, kFilter);
    overlapping(table, index, cube(0, 0, 0, 1));
    EXPECT_LT(index.bytes(), 60u * table.size());
}
}  // namespace
}  // namespace cullet::test
