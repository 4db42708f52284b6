// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/proxy_table.h"
#include "cullet/broad/queries/query_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

namespace cullet
{
namespace
{
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr Filter kFilter = {1, -1};

const QueryOptions kAllOptions[] = {{QueryMode::Automatic, false}, {QueryMode::Scan, false},
                                    {QueryMode::Tree, false},      {QueryMode::Automatic, true},
                                    {QueryMode::Scan, true},       {QueryMode::Tree, true}};

Aabb cube(float x, float y, float z, float half)
{
    return {{x - half, y - half, z - half}, {x + half, y + half, z + half}};
}

class Random
{
public:
    explicit Random(unsigned seed) : m_engine(seed) {}
    float uniform(float low, float high)
    {
        return low + (high - low) * static_cast<float>(m_engine() * 0x1p-32);
    }
    std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(m_engine() % n); }

private:
    std::mt19937 m_engine;
};

/// The coordinates are drawn in the order in which GCC evaluates arguments, which recorded counts rely on.
Aabb anyCube(Random& random, float low, float high, float half)
{
    const float z = random.uniform(low, high), y = random.uniform(low, high), x = random.uniform(low, high);
    return cube(x, y, z, half);
}

/// Runs a query and fails on a row that is reported twice.
template <class Query>
std::vector<ProxyId> collect(const ProxyTable& table, Query query)
{
    std::vector<ProxyId> rows;
    std::vector<bool> seen(table.size(), false);
    query(
        [&](ProxyId row)
        {
            EXPECT_FALSE(seen[row]) << "row " << row << " twice";
            seen[row] = true;
            rows.push_back(row);
        });
    std::sort(rows.begin(), rows.end());
    return rows;
}

/// The candidates that pass the caller's exact test.
std::vector<ProxyId> overlapping(const ProxyTable& table, const QueryIndex& index, const Aabb& box)
{
    std::vector<ProxyId> rows = collect(table, [&](auto visit) { index.forEachOverlap(box, visit); });
    rows.erase(
        std::remove_if(rows.begin(), rows.end(), [&](ProxyId row) { return !overlaps(table.box(row), box); }),
        rows.end());
    return rows;
}

std::vector<ProxyId> onRay(const ProxyTable& table, const QueryIndex& index, const RaySegment& ray)
{
    return collect(table, [&](auto visit) { index.forEachOnRay(ray, visit); });
}

std::vector<ProxyId> overlappingByBruteForce(const ProxyTable& table, const Aabb& box)
{
    std::vector<ProxyId> rows;
    for (ProxyId row = 0; row < table.size(); ++row)
    {
        if (isValid(box) && isValid(table.box(row)) && overlaps(table.box(row), box))
            rows.push_back(row);
    }
    return rows;
}

/// The box test of Bullet's tree, in its order of comparisons and in the precision of either Bullet build.
template <class Scalar>
bool bulletHits(const RaySegment& ray, const Aabb& box)
{
    Scalar enter[3];
    Scalar leave[3];
    for (int axis = 0; axis < 3; ++axis)
    {
        const Scalar origin = static_cast<Scalar>(ray.origin[axis]);
        const Scalar inverse = static_cast<Scalar>(ray.inverseDirection[axis]);
        const Scalar low = static_cast<Scalar>(box.min[axis]) - static_cast<Scalar>(ray.growMax[axis]);
        const Scalar high = static_cast<Scalar>(box.max[axis]) - static_cast<Scalar>(ray.growMin[axis]);
        enter[axis] = ((inverse < 0 ? high : low) - origin) * inverse;
        leave[axis] = ((inverse < 0 ? low : high) - origin) * inverse;
    }
    Scalar first = enter[0];
    Scalar last = leave[0];
    for (int axis = 1; axis < 3; ++axis)
    {
        if (first > leave[axis] || enter[axis] > last)
            return false;
        if (enter[axis] > first)
            first = enter[axis];
        if (leave[axis] < last)
            last = leave[axis];
    }
    return first < static_cast<Scalar>(ray.lambdaMax) && last > 0;
}

RaySegment rayAlong(const float* origin, const float* direction, double lambdaMax)
{
    RaySegment ray = {};
    for (int axis = 0; axis < 3; ++axis)
    {
        ray.origin[axis] = origin[axis];
        // Prepared as in Bullet's float build; a direction of -0 is parallel with a positive sign.
        ray.inverseDirection[axis] = direction[axis] == 0.0f ? 1e18f : 1.0f / direction[axis];
    }
    ray.lambdaMax = lambdaMax;
    return ray;
}

/// Boxes on a coarse lattice, so that rays along faces and corners are frequent, including all special kinds.
Aabb randomBox(Random& random)
{
    const std::uint32_t kind = random.below(40);
    Aabb box;
    for (int axis = 0; axis < 3; ++axis)
    {
        const float corner = static_cast<float>(random.below(24)) - 12.0f;
        const float size = kind < 20 ? static_cast<float>(random.below(3)) : random.uniform(0.0f, 2.0f);
        box.min[axis] = kind < 20 ? corner : random.uniform(-12.0f, 12.0f);
        box.max[axis] = box.min[axis] + size;
    }
    if (kind == 30)
        box.min[random.below(3)] = kNan;
    if (kind == 31)
        std::swap(box.min[1], box.max[1]), box.min[1] += 1.0f;
    if (kind == 32)
        box.min[0] = -1e18f, box.max[0] = 1e18f, box.min[2] = -1e18f, box.max[2] = 1e18f;
    if (kind == 33)
        box.max[random.below(3)] = kInf;
    if (kind == 34)
        box.min[1] = -1e30f;
    if (kind == 35)
        box.max[0] += 50.0f;
    return box;
}

RaySegment randomRay(Random& random)
{
    float origin[3];
    float direction[3];
    const std::uint32_t kind = random.below(16);
    for (int axis = 0; axis < 3; ++axis)
    {
        const bool onLattice = kind < 8;
        origin[axis] =
            onLattice ? static_cast<float>(random.below(28)) - 14.0f : random.uniform(-14.0f, 14.0f);
        direction[axis] =
            kind % 4 == 0 ? static_cast<float>(random.below(3)) - 1.0f : random.uniform(-1.0f, 1.0f);
        if (kind == 1 && random.below(2) == 0)
            direction[axis] = -0.0f;
    }
    const float length =
        std::sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    for (float& d : direction)
        d = length == 0.0f ? 0.0f : d / length;
    RaySegment ray = rayAlong(origin, direction, random.below(4) == 0 ? random.uniform(0.0f, 5.0f) : 40.0);
    if (kind == 2 || length == 0.0f)  // a sweep of length 0
    {
        ray.lambdaMax = 0.0;
        for (double& inverse : ray.inverseDirection)
            inverse = 1e18;
    }
    if (kind == 3)
        ray.origin[random.below(3)] = random.below(2) == 0 ? 1e18 : -1e18;
    if (kind == 5)
    {
        for (double& inverse : ray.inverseDirection)
        {
            if (std::abs(inverse) > 1e17)
                inverse = random.below(2) == 0 ? 1e30 : -1e30;
        }
    }
    if (random.below(2) == 0)  // a sweep of a box whose origin is not in its middle
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            ray.growMin[axis] = -0.5 * random.below(4);
            ray.growMax[axis] = 0.25 * random.below(8);
        }
    }
    return ray;
}

TEST(QueryIndex, FindsOverlapsOfBruteForceForAllKindsOfBoxes)
{
    std::uint64_t hits = 0;
    std::uint64_t checks = 0;
    for (const QueryOptions& options : kAllOptions)
    {
        ProxyTable table;
        const QueryIndex index(table, options);
        Random random(11);
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

/// Counts over all rays of a test; the lower and upper bounds ensure a representative sample.
struct RayCount
{
    std::uint64_t checks = 0;
    std::uint64_t hits = 0;
    std::uint64_t extras = 0;  // candidates that neither precision of Bullet reports
};

void checkRay(const ProxyTable& table, const QueryIndex& index, const RaySegment& ray, RayCount& count)
{
    const std::vector<ProxyId> rows = onRay(table, index, ray);
    auto row = rows.begin();
    for (ProxyId i = 0; i < table.size(); ++i)
    {
        const bool isVisited = row != rows.end() && *row == i;
        if (isVisited)
            ++row;
        const bool isHit = isValid(table.box(i)) &&
                           (bulletHits<float>(ray, table.box(i)) || bulletHits<double>(ray, table.box(i)));
        ASSERT_TRUE(isVisited || !isHit) << "row " << i << " is missed";
        ASSERT_TRUE(!isVisited || isValid(table.box(i))) << "row " << i << " is empty";
        count.hits += isHit ? 1 : 0;
        count.extras += isVisited && !isHit ? 1 : 0;
        ++count.checks;
    }
}

TEST(QueryIndex, NeverMissesRayHitOfSlabTestInEitherPrecision)
{
    RayCount count;
    for (const QueryOptions& options : kAllOptions)
    {
        ProxyTable table;
        const QueryIndex index(table, options);
        Random random(12);
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
    Random random(16);
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
    Random random(13);
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
int changeAtRandom(ProxyTable& table, std::vector<ProxyId>& live, std::uint32_t& nextId, Random& random)
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
        Random random(14);
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
    Random random(15);
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
    Random random(16);
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

Aabb cubeInCrowd(Random& random)
{
    return anyCube(random, 0, 60, 0.5f);
}

std::vector<ProxyId> fillCrowd(ProxyTable& table, std::uint32_t count, Random& random)
{
    std::vector<ProxyId> rows;
    for (std::uint32_t i = 0; i < count; ++i)
        rows.push_back(table.create(cubeInCrowd(random), i + 1, kFilter));
    return rows;
}

void ask(const QueryIndex& index, Random& random, std::uint32_t times)
{
    for (std::uint32_t i = 0; i < times; ++i)
        index.forEachOverlap(cubeInCrowd(random), [](ProxyId) {});
}

constexpr std::uint32_t kCrowd = 30000;

/// Calls change(i) `count` times, with a query after each, and expects no scan of all boxes.
template <class Change>
void expectFewTestsAfterEach(const QueryIndex& index, Random& random, const Change& change)
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
    Random random(17);
    expectFewTestsAfterEach(index, random,
                            [&](std::uint32_t i) { table.create(cubeInCrowd(random), i + 1, kFilter); });
}

TEST(QueryIndex, TestsFewBoxesInQueryAfterEachTeleportedBox)
{
    ProxyTable table;
    const QueryIndex index(table);
    Random random(18);
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
    Random random(19);
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
    Random random(23);
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
    Random random(24);
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
    Random random(20);
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
    Random random(21);
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
void changeOne(ProxyTable& table, std::vector<ProxyId>& live, std::uint32_t& nextId, Random& random)
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
        Random random(22);
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
}  // namespace cullet
