// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/broad/queries/query_checks.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
TEST(QueryIndex, FindsOverlapsOfBruteForceForAllKindsOfBoxes)
{
    std::uint64_t hits = 0;
    std::uint64_t checks = 0;
    for (const QueryOptions& options : kAllOptions)
    {
        ProxyTable table;
        const QueryIndex index(table, options);
        QueryRandom random(11);
        for (std::uint32_t i = 0; i < 1500; ++i)
            table.create(randomBox(random), i + 1, kFilter);
        for (int i = 0; i < 400; ++i)
        {
            const Aabb box = randomBox(random);
            const std::vector<ProxyId> expected = overlappingByBruteForce(table, box);
            ASSERT_EQ(overlapping(table, index, box), expected) << "query " << i;
            hits += expected.size();
            checks += table.size();
        }
    }
    EXPECT_GT(hits, checks / 200);
    EXPECT_LT(hits, checks / 4);
}

TEST(QueryIndex, NeverMissesRayHitOfSlabTestInEitherPrecision)
{
    RayCount count;
    for (const QueryOptions& options : kAllOptions)
    {
        ProxyTable table;
        const QueryIndex index(table, options);
        QueryRandom random(12);
        for (std::uint32_t i = 0; i < 700; ++i)
            table.create(randomBox(random), i + 1, kFilter);
        for (int i = 0; i < 1500; ++i)
        {
            SCOPED_TRACE(i);
            checkRay(table, index, randomRay(random), count);
            if (HasFatalFailure())
                return;
        }
    }
    EXPECT_GT(count.checks, 1000000u);
    EXPECT_GT(count.hits, count.checks / 100);
    EXPECT_LT(count.hits, count.checks / 4);
    // The extras should be rays along faces and from far away only.
    EXPECT_LT(count.extras, count.hits / 3);
}

TEST(QueryIndex, CoversRoundingOfFloatSlabTestFarFromOrigin)
{
    constexpr float kFar = 300000.0f;  // floats are 1/32 apart here
    ProxyTable table;
    const QueryIndex index(table, {QueryMode::Tree, false});
    QueryRandom random(16);
    const auto position = [&] { return kFar + random.uniform(-10, 10); };
    for (std::uint32_t i = 0; i < 400; ++i)
    {
        const float z = position(), y = position(), x = position();
        table.create(cube(x, y, z, 0.5f), i + 1, kFilter);
    }
    RayCount count;
    for (int i = 0; i < 10000; ++i)
    {
        SCOPED_TRACE(i);
        const float origin[3] = {position(), position(), position()};
        const float direction[3] = {0.6f, i % 4 == 0 ? 0.64f : 0.0f, i % 8 == 0 ? -0.48f : 0.0f};
        RaySegment ray = rayAlong(origin, direction, 10.0);
        for (int axis = 0; axis < 3; ++axis)
        {
            ray.growMin[axis] = random.uniform(-0.3f, 0.0f);
            ray.growMax[axis] = random.uniform(0.0f, 0.3f);
        }
        checkRay(table, index, ray, count);
        if (HasFatalFailure())
            return;
    }
    EXPECT_GT(count.hits, 5000u);
    EXPECT_GT(count.extras, 0u) << "no ray came close enough to a face";
}

TEST(QueryIndex, VisitsAlmostNoExtraCandidatesOnRaysInGeneralPosition)
{
    ProxyTable table;
    const QueryIndex index(table, {QueryMode::Tree, false});
    QueryRandom random(13);
    for (std::uint32_t i = 0; i < 5000; ++i)
        table.create(anyCube(random, -50, 50, 3.0f), i + 1, kFilter);
    RayCount count;
    for (int i = 0; i < 200; ++i)
    {
        const float origin[3] = {random.uniform(-50, 50), random.uniform(-50, 50), random.uniform(-50, 50)};
        const float direction[3] = {0.6f, i % 2 == 0 ? 0.64f : -0.64f, 0.48f};
        checkRay(table, index, rayAlong(origin, direction, 100.0), count);
    }
    EXPECT_GT(count.hits, 1000u);
    EXPECT_LE(count.extras, count.hits / 500);
}

TEST(QueryIndex, FindsBoxesAroundPointWhenSweepHasNoLength)
{
    for (const QueryOptions& options : kAllOptions)
    {
        ProxyTable table;
        const QueryIndex index(table, options);
        table.create(cube(0, 0, 0, 1), 1, kFilter);
        table.create(cube(5, 0, 0, 1), 2, kFilter);
        RaySegment sweep = {{0.5, 0.5, 0.5}, {1e18, 1e18, 1e18}, 0.0, {0, 0, 0}, {0, 0, 0}};
        EXPECT_EQ(onRay(table, index, sweep), (std::vector<ProxyId>{0}));
        sweep.growMax[0] = 4.0;
        EXPECT_EQ(onRay(table, index, sweep), (std::vector<ProxyId>{0, 1}));
    }
}

TEST(QueryIndex, FindsNothingOrEverythingOnRaysWithNanOrInfinity)
{
    for (const QueryOptions& options : kAllOptions)
    {
        ProxyTable table;
        const QueryIndex index(table, options);
        table.create(cube(0, 0, 0, 1), 1, kFilter);
        table.create(kEmptyAabb, 2, kFilter);
        table.create({{-kInf, -kInf, -kInf}, {kInf, 0, kInf}}, 3, kFilter);
        const RaySegment zeroLength = {{0, 0, 0}, {kNan, kNan, kNan}, kNan, {0, 0, 0}, {0, 0, 0}};
        EXPECT_TRUE(onRay(table, index, zeroLength).empty());
        const RaySegment fromInfinity = {{0, kInf, 0}, {1e18, -1, 1e18}, 10, {0, 0, 0}, {0, 0, 0}};
        EXPECT_EQ(onRay(table, index, fromInfinity), (std::vector<ProxyId>{0, 2}));
        const RaySegment nanInY = {{0, 0, 0}, {1, kNan, 1e18}, 10, {0, 0, 0}, {0, 0, 0}};
        EXPECT_EQ(onRay(table, index, nanInY), (std::vector<ProxyId>{0, 2}));
    }
}

TEST(QueryIndex, TreatsInfiniteInverseDirectionAsParallelToAxis)
{
    for (const QueryOptions& options : kAllOptions)
    {
        ProxyTable table;
        const QueryIndex index(table, options);
        table.create({{5, 0, 0}, {6, 1, 1}}, 1, kFilter);
        for (const double parallel : {static_cast<double>(kInf), -static_cast<double>(kInf)})
        {
            RaySegment ray = {{0, 0, 1}, {1, parallel, parallel}, 10, {0, 0, 0}, {0, 0, 0}};
            EXPECT_EQ(onRay(table, index, ray).size(), 1u) << "along an edge";
            ray.origin[1] = 1.5;
            EXPECT_TRUE(onRay(table, index, ray).empty());
        }
    }
}

TEST(QueryIndex, FindsUnboundedBoxesFromEverywhere)
{
    for (const QueryOptions& options : kAllOptions)
    {
        ProxyTable table;
        const QueryIndex index(table, options);
        for (std::uint32_t i = 0; i < 300; ++i)
            table.create(cube(3.0f * i, 0, 0, 1), i + 1, kFilter);
        const ProxyId plane = table.create({{-1e18f, -1e18f, -1e18f}, {1e18f, 0, 1e18f}}, 1000, kFilter);
        const ProxyId all = table.create({{-kInf, -kInf, -kInf}, {kInf, kInf, kInf}}, 1001, kFilter);
        EXPECT_EQ(overlapping(table, index, cube(-1e6f, -5, 7, 1)), (std::vector<ProxyId>{plane, all}));
        EXPECT_EQ(overlapping(table, index, cube(-1e6f, 5, 7, 1)), (std::vector<ProxyId>{all}));
        EXPECT_EQ(overlapping(table, index, {{-kInf, -kInf, -kInf}, {kInf, kInf, kInf}}).size(), 302u);
        table.setBox(plane, cube(-1e6f, 5, 7, 1));
        table.destroy(all);
        EXPECT_EQ(overlapping(table, index, cube(-1e6f, 5, 7, 1)), (std::vector<ProxyId>{plane}));
    }
}

/// Makes one random change of a table; returns its kind, for the test's counts.
int changeAtRandom(ProxyTable& table, std::vector<ProxyId>& live, std::uint32_t& nextId, QueryRandom& random)
{
    const std::uint32_t kind = random.below(20);
    if (kind < 3 || live.size() < 50)
    {
        live.push_back(table.create(randomBox(random), nextId++, kFilter));
        return 0;
    }
    const std::uint32_t at = random.below(static_cast<std::uint32_t>(live.size()));
    if (kind < 5)
    {
        table.destroy(live[at]);
        live[at] = live.back();
        live.pop_back();
        return 1;
    }
    if (kind < 7)
    {
        table.setBox(live[at], randomBox(random));
        return 2;
    }
    Aabb box = table.box(live[at]);
    for (int axis = 0; axis < 3; ++axis)
    {
        const float shift = random.uniform(-0.1f, 0.1f);
        box.min[axis] += shift;
        box.max[axis] += shift;
    }
    table.setBox(live[at], box);
    return 3;
}

TEST(QueryIndex, EqualsBruteForceUnderAnyInterleavingOfChangesAndQueries)
{
    for (const QueryOptions& options : kAllOptions)
    {
        ProxyTable table;
        const QueryIndex index(table, options);
        QueryRandom random(14);
        std::vector<ProxyId> live;
        std::uint32_t nextId = 1;
        int kinds[4] = {};
        RayCount rays;
        for (int step = 0; step < 300; ++step)
        {
            SCOPED_TRACE(step);
            // From single changes to all rows at once, so that every update path of the trees is used.
            const std::uint32_t changes = random.below(4) == 0 ? 1200 : random.below(12);
            for (std::uint32_t i = 0; i < changes; ++i)
                ++kinds[changeAtRandom(table, live, nextId, random)];
            for (std::uint32_t i = random.below(12); i > 0; --i)
            {
                const Aabb box = randomBox(random);
                ASSERT_EQ(overlapping(table, index, box), overlappingByBruteForce(table, box));
                checkRay(table, index, randomRay(random), rays);
                ASSERT_FALSE(HasFatalFailure());
            }
            if (random.below(3) == 0)
            {
                table.beginUpdate(0.0f, false);
                table.endUpdate();
            }
        }
        EXPECT_GT(*std::min_element(kinds, kinds + 4), 1000);
        EXPECT_GT(rays.hits, 10000u);
        EXPECT_EQ(index.buildsTotal() > 1, options.mode != QueryMode::Scan);
    }
}

TEST(QueryIndex, FindsNothingInBoxesWhoseMinimaExceedTheirMaxima)
{
    for (const QueryOptions& options : kAllOptions)
    {
        ProxyTable table;
        const QueryIndex index(table, options);
        for (std::uint32_t i = 0; i < 200; ++i)
            table.create(cube(0, 0, 0, 4), i + 1, kFilter);
        const Aabb inverted = {{1, 1, 1}, {-1, -1, -1}};
        EXPECT_TRUE(overlapping(table, index, inverted).empty());
        index.scanOverlap(inverted, [](ProxyId row) { ADD_FAILURE() << row; });
        std::uint32_t count = 0;
        index.scanOverlap({{-1, -1, -1}, {1, 1, 1}}, [&](ProxyId row) { EXPECT_EQ(row, count++); });
        EXPECT_EQ(count, 200u);
    }
}

TEST(QueryIndex, FindsNothingAfterTableIsClearedUntilItIsFilledAgain)
{
    for (const QueryOptions& options : kAllOptions)
    {
        ProxyTable table;
        const QueryIndex index(table, options);
        const Aabb everything = {{-kInf, -kInf, -kInf}, {kInf, kInf, kInf}};
        EXPECT_TRUE(overlapping(table, index, everything).empty());
        for (std::uint32_t i = 0; i < 200; ++i)
            table.create(cube(3.0f * i, 0, 0, 1), i + 1, kFilter);
        EXPECT_EQ(overlapping(table, index, everything).size(), 200u);
        table.clear();
        EXPECT_TRUE(overlapping(table, index, everything).empty());
        table.create(cube(1, 2, 3, 1), 1, kFilter);
        EXPECT_EQ(overlapping(table, index, everything), (std::vector<ProxyId>{0}));
    }
}

TEST(QueryIndex, AnswersNestedQueriesWithAndWithoutPendingChanges)
{
    for (const QueryOptions& options : kAllOptions)
    {
        ProxyTable table;
        const QueryIndex index(table, options);
        for (std::uint32_t i = 0; i < 1000; ++i)
            table.create(cube(1.5f * i, 0, 0, 1), i + 1, kFilter);
        for (const bool moves : {true, false})
        {
            if (moves)
                table.setBox(500, cube(751, 0, 0, 1));
            int outer = 0;
            int inner = 0;
            index.forEachOverlap(cube(750, 0, 0, 300),
                                 [&](ProxyId row)
                                 {
                                     ++outer;
                                     index.forEachOverlap(table.box(row), [&](ProxyId) { ++inner; });
                                 });
            EXPECT_EQ(outer, 401);
            EXPECT_EQ(inner, 3 * 401);
        }
    }
}
}  // namespace
}  // namespace cullet::test
