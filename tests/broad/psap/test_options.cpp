// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Effects of the options of the sweep-and-prune backends on their work; the conformance suite checks the pairs.

#include "cullet/broad/psap/search.h"
#include "cullet/comparison/thesis/cell_search.h"
#include "cullet/cuda/host/host_exec.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/pair_lists.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <vector>

namespace cullet::test
{
namespace
{
/// HostExec that records the largest number of tests by one index of a step.
class CountingExec : public psap::HostExec
{
public:
    using HostExec::HostExec;

    template <class Step>
    void forEachAppend(std::uint64_t count, const Step& step, const psap::PairList& list)
    {
        struct TestCounter
        {
            const psap::PairList& pairs;
            std::uint64_t tests = 0;

            void push(RowPair pair) { pairs.push(pair); }
            void tested(std::uint64_t made) { tests += made; }
        };
        for (std::uint64_t i = 0; i < count; ++i)
        {
            TestCounter counter{list};
            step(i, counter);
            mostTests = std::max(mostTests, counter.tests);
            allTests += counter.tests;
        }
    }

    std::uint64_t mostTests = 0;
    std::uint64_t allTests = 0;
};

struct Work
{
    std::uint64_t pairs = 0;
    std::uint64_t tests = 0;
    std::uint64_t mostTests = 0;
    std::uint64_t falsePairs = 0;
};

/// Every overlapping pair of a scene by the search with cells.
Work searchOnce(const std::vector<Aabb>& boxes, const ThesisOptions& options)
{
    CountingExec exec(options);
    psap::CellSearch<CountingExec> search(options);
    search.build(exec, {boxes.data(), boxes.size()});
    std::vector<RowPair> found(1u << 20);
    std::uint64_t count = 0;
    search.emit(exec, psap::EveryPair{}, {found.data(), found.size(), &count});
    EXPECT_LE(count, found.size());
    return {count, exec.allTests, exec.mostTests, search.falsePairCount()};
}

ThesisOptions withCells(ThesisCells cells, std::uint32_t cellCount)
{
    ThesisOptions options;
    options.cells = cells;
    options.cellCount = cellCount;
    return options;
}

std::vector<Aabb> uniformCubes(std::uint32_t count, float side, Random& random)
{
    std::vector<Aabb> boxes;
    for (std::uint32_t i = 0; i < count; ++i)
        boxes.push_back(boxAt(random.point(0, side)));
    return boxes;
}

/// Centres in a thin slab along (1, 1, 0) and z.
std::vector<Aabb> slantedSlab(std::uint32_t count, Random& random)
{
    std::vector<Aabb> boxes;
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const float far = random.between(-150, 150), across = random.between(-2, 2);
        boxes.push_back(boxAt(far + across, far - across, random.between(-100, 100)));
    }
    return boxes;
}

/// Every overlapping pair of a scene by the counting-sort search, in order.
Pairs pairsOfRows(const std::vector<Aabb>& boxes, const PsapOptions& options)
{
    psap::HostExec exec(options);
    psap::CountingSearch<psap::HostExec> search(options, options.axis);
    std::vector<RowPair> found(1u << 18);
    std::uint64_t count = 0;
    // The second update uses the state of the first.
    for (int update = 0; update < 2; ++update)
    {
        search.build(exec, {boxes.data(), boxes.size(), &count});
        search.emit(exec, psap::EveryPair{}, {found.data(), found.size(), &count});
    }
    EXPECT_LE(count, found.size());
    found.resize(count);
    return inOrder(found);
}

// With up to a dozen cells across, a cell ahead of a box may be a wrapped cell behind it: a different rule then decides
// which box reports a pair.
TEST(PsapSearch, FindsEachPairOnceWhenGridHasFewCells)
{
    SCOPED_TRACE("seed 11");
    Random random(11);
    std::size_t pairs = 0;
    for (float side = 2; side < 60; side *= 1.1f)
    {
        std::vector<Aabb> boxes = uniformCubes(400, side, random);
        // Some boxes far outside of the planned range, and a larger one.
        for (std::uint32_t i = 0; i < 20; ++i)
        {
            const float y = random.between(0, side), x = random.between(-9 * side, 9 * side);
            boxes.push_back(boxAt(x, y, side / 2));
        }
        for (std::uint32_t i = 0; i < 5; ++i)
            boxes.push_back({{random.between(0, side), 0, 0}, {2 * side, side / 3, side / 3}});
        const Pairs expected = everyPair(boxes);
        pairs += expected.size();
        for (const float cell : {0.0f, 0.3f, 1.0f, 2.0f})
        {
            PsapOptions inOrder;
            inOrder.cellScale = cell;
            PsapOptions shuffled = inOrder;
            shuffled.executor = PsapExecutor::Shuffled;
            PsapOptions grouped = inOrder;
            grouped.rowSearch = PsapRowSearch::Grouped;
            for (const PsapOptions& options : {inOrder, shuffled, grouped})
            {
                const Pairs found = pairsOfRows(boxes, options);
                EXPECT_TRUE(found == expected) << "side " << side << ", cells of " << cell << ": "
                                               << found.size() << " pairs instead of " << expected.size();
            }
        }
    }
    EXPECT_GT(pairs, 100000u);
}

TEST(PsapSearch, ComputesPrincipalDirectionsOfCloud)
{
    SCOPED_TRACE("seed 1");
    Random random(1);
    psap::CentreSums sums;
    sums.reset();
    for (int i = 0; i < 10000; ++i)
    {
        // Spread widely along (2, 1, 2) / 3, less along (-2, 2, 1) / 3, hardly along (1, 2, -2) / 3.
        const float a = random.between(-30, 30), b = random.between(-10, 10), c = random.between(-1, 1);
        sums.add(boxAt((2 * a - 2 * b + c) / 3 + 5, (a + 2 * b + 2 * c) / 3 - 7, (2 * a + b - 2 * c) / 3));
    }
    const psap::Directions found = psap::principalDirections(sums);
    const float expected[3][3] = {{2, 1, 2}, {-2, 2, 1}, {1, 2, -2}};
    for (int k = 0; k < 3; ++k)
    {
        float cosine = 0;
        for (int axis = 0; axis < 3; ++axis)
            cosine += found.along[k][axis] * expected[k][axis] / 3;
        // The variance of 10,000 samples rotates the directions by about a hundredth.
        EXPECT_GT(std::fabs(cosine), 0.999f) << k;
    }
}

TEST(PsapSearch, LeavesInvalidAndUnboundedBoxesOutOfPrincipalDirections)
{
    const std::vector<Aabb> boxes = {
        boxAt(1, 2, 3), cube(2, -8), boxAt(5, 6, 7), boxAt(0, 0, 0, 1e20f), {{kNan, 0, 0}, {1, 1, 1}}};
    psap::CentreSums sums;
    psap::SumCentres{boxes.data(), boxes.size(), 1, &sums}(0);
    EXPECT_EQ(sums.count, 2u);
    EXPECT_EQ(sums.sum[0], 6);
    EXPECT_EQ(sums.product[0], 26);
    EXPECT_EQ(sums.product[3], 1 * 2 + 5 * 6);
}

TEST(PsapSearch, UsesWorldAxesWhenSpreadIsZeroOrOverflows)
{
    psap::CentreSums none, one, same, apart;
    for (psap::CentreSums* sums : {&none, &one, &same, &apart})
        sums->reset();
    one.add(boxAt(3, -5, 7));
    // Sums of a power of two of halves are exact: the variance is 0 instead of a rounding error.
    for (int i = 0; i < 1024; ++i)
        same.add(boxAt(0.5f, -2.5f, 3));
    apart.add(cube(3e38f, 3e38f));
    apart.add(cube(-3e38f, -3e38f));
    apart.product[0] = std::numeric_limits<double>::infinity();
    const float axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (const psap::CentreSums& sums : {none, one, same})
    {
        SCOPED_TRACE(testing::Message() << sums.count << " boxes");
        const psap::Directions found = psap::principalDirections(sums);
        // In any order, since the spread is the same along all of them.
        for (const float(&axis)[3] : axes)
        {
            const auto isAxis = [&](const float(&direction)[3])
            { return std::equal(std::begin(axis), std::end(axis), std::begin(direction)); };
            EXPECT_EQ(std::count_if(std::begin(found.along), std::end(found.along), isAxis), 1);
        }
    }
    const psap::Directions found = psap::principalDirections(apart);
    for (int k = 0; k < 3; ++k)
    {
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_EQ(found.along[k][axis], axes[k][axis]);
    }
}

TEST(PsapSearch, ProjectsTouchingBoxesToOverlappingOnes)
{
    SCOPED_TRACE("seed 2");
    Random random(2);
    int touching = 0;
    for (int i = 0; i < 20000; ++i)
    {
        // Boxes that touch in one point, at sizes where every product is rounded.
        const float half = random.logUniform(-8, 8);
        Aabb boxes[2] = {boxAt(random.point(-1000, 1000), half)};
        for (int axis = 0; axis < 3; ++axis)
        {
            boxes[1].min[axis] = boxes[0].max[axis];
            boxes[1].max[axis] = boxes[1].min[axis] + random.between(0, 3);
        }
        psap::Directions directions;
        for (auto& direction : directions.along)
        {
            for (float& component : direction)
                component = random.between(-1, 1);
        }
        Aabb projections[2];
        for (std::uint64_t k = 0; k < 2; ++k)
            psap::ProjectBox{boxes, directions, projections}(k);
        ASSERT_TRUE(isValid(projections[0]) && isValid(projections[1]));
        ASSERT_TRUE(overlaps(projections[0], projections[1])) << "box pair " << i;
        for (int axis = 0; axis < 3; ++axis)
            touching += projections[0].max[axis] == projections[1].min[axis] ? 1 : 0;
    }
    EXPECT_GT(touching, 100) << "otherwise the rounding was never put to the test";
}

TEST(PsapSearch, MakesFewerTestsWithPrincipalAxisOnlyInSlantedSlab)
{
    SCOPED_TRACE("seed 3");
    Random random(3);
    for (const bool isSlanted : {true, false})
    {
        const std::vector<Aabb> boxes =
            isSlanted ? slantedSlab(20000, random) : uniformCubes(20000, 60, random);
        ThesisOptions options = withCells(ThesisCells::FixedCount, 64);
        const Work variance = searchOnce(boxes, options);
        options.isAxisPrincipal = true;
        const Work principal = searchOnce(boxes, options);
        EXPECT_EQ(principal.pairs, variance.pairs);
        EXPECT_GT(principal.pairs, 1000u);
        if (isSlanted)
        {
            EXPECT_LT(2 * principal.tests, variance.tests) << "square cells across the slab are wasted on it";
        }
        else
        {
            EXPECT_GT(principal.tests, variance.tests) << "projections are longer than boxes";
        }
    }
}

TEST(RadixSort, OrdersFloatsByKeyAndKeepsOrderOfEqualOnes)
{
    SCOPED_TRACE("seed 8");
    Random random(8);
    std::vector<float> values = {0.0f,    -0.0f, kInfinity, -kInfinity, 1e-45f,
                                 -1e-45f, 3e38f, -3e38f,    1.0f,       std::nextafter(1.0f, 2.0f)};
    while (values.size() < 5000)
        values.push_back(random.chance(0.2f) ? values[random.below(10)] : random.between(-1e6f, 1e6f));
    std::vector<std::uint32_t> keys, sortedKeys(values.size()), rows(values.size()),
        sortedRows(values.size());
    for (const float value : values)
        keys.push_back(psap::orderedBits(value));
    std::iota(rows.begin(), rows.end(), 0u);
    psap::HostExec exec(PsapOptions{});
    exec.sortPairs(keys.data(), sortedKeys.data(), rows.data(), sortedRows.data(), keys.size(), 32);
    int equalCount = 0;
    for (std::size_t i = 1; i < sortedRows.size(); ++i)
    {
        const float before = values[sortedRows[i - 1]];
        const float after = values[sortedRows[i]];
        ASSERT_LE(before, after);
        if (before == after)
        {
            ASSERT_LT(sortedRows[i - 1], sortedRows[i])
                << "equal ones, -0 and 0 among them, keep their order";
            ++equalCount;
        }
    }
    EXPECT_GT(equalCount, 500);
}

/// The cells for `count` boxes in a room with sides `u` and `v` across the sweep axis.
psap::CellPlan planFor(ThesisCells rule, std::uint64_t count, float u, float v, std::uint32_t cellCount = 1)
{
    psap::Moments moments;
    moments.reset();
    for (const Aabb& corner : {boxAt(0, 0, 0, 1), boxAt(100, u, v, 1)})
        moments.add(corner);
    moments.count = count;
    const psap::SizeClasses sizes = {};
    psap::CellPlan plan = {};
    psap::PlanCells{&moments, &sizes, PsapAxis::X, rule, cellCount, &plan}(0);
    return plan;
}

TEST(PsapSearch, PlansOneThesisCellPer64000BoxesRoundedUp)
{
    const auto cells = [](std::uint64_t boxes, float u = 100)
    {
        const psap::CellPlan plan = planFor(ThesisCells::Thesis, boxes, u, 100);
        return std::uint64_t{plan.countU} * plan.countV;
    };
    EXPECT_EQ(cells(0), 1u);
    EXPECT_EQ(cells(1), 1u);
    EXPECT_EQ(cells(64000), 1u);
    EXPECT_EQ(cells(64001), 2u);
    EXPECT_EQ(cells(125000), 2u);
    EXPECT_EQ(cells(4 * 64000), 4u);
    EXPECT_EQ(cells(4 * 64000 + 1), 6u) << "five, and one more to fill the columns";
    EXPECT_EQ(cells(1000000), 16u);
    EXPECT_EQ(cells(1000000, 100000), 16u) << "no more columns than cells";
    EXPECT_EQ(cells(1000000, 0), 16u);
}

TEST(PsapSearch, PlansAtLeastFixedNumberOfNearlySquareCells)
{
    for (const std::uint32_t wanted : {1u, 5u, 20u, 1000u, 5000u})
    {
        SCOPED_TRACE(wanted);
        const psap::CellPlan plan = planFor(ThesisCells::FixedCount, 100000, 100, 200, wanted);
        EXPECT_GE(plan.countU * plan.countV, wanted);
        EXPECT_LT(plan.countU * plan.countV, wanted + plan.countU);
        EXPECT_GE(plan.countV, plan.countU);
        EXPECT_LE(plan.countV, 5 * plan.countU);
    }
}

/// The automatic cells for `count` boxes with sides of 2 in a room with sides `u` and `v` across the sweep axis.
psap::CellPlan automaticPlanFor(std::uint64_t count, float u, float v)
{
    psap::Moments moments;
    moments.reset();
    for (const Aabb& corner : {boxAt(0, 0, 0, 1), boxAt(100, u, v, 1)})
        moments.add(corner);
    for (double& sum : moments.extent)
        sum *= static_cast<double>(count) / 2;
    moments.count = count;
    const psap::SizeClasses sizes = {};
    psap::CellPlan plan = {};
    psap::PlanCells{&moments, &sizes, PsapAxis::X, ThesisCells::Automatic, 1, &plan}(0);
    return plan;
}

TEST(PsapSearch, PlansAutomaticCellsThreeMeanSidesWide)
{
    for (const float v : {6.0f, 60.0f, 300.0f, 1200.0f})
    {
        const psap::CellPlan plan = automaticPlanFor(100000, 600, v);
        EXPECT_EQ(plan.countU, 100u);
        EXPECT_EQ(plan.countV, static_cast<std::uint32_t>(v / 6));
    }
}

TEST(PsapSearch, PlansNoMoreAutomaticCellsThanBoxes)
{
    for (const std::uint64_t count : {4u, 200u, 2000u, 4900u})
    {
        SCOPED_TRACE(count);
        const psap::CellPlan plan = automaticPlanFor(count, 600, 300);
        EXPECT_LE(plan.countU * plan.countV, count);
        EXPECT_GE(2 * plan.countU * plan.countV, count);
        EXPECT_NEAR(plan.countU, 2 * plan.countV, 1);
    }
}

TEST(PsapSearch, MakesNoTestsInCellsWithOneBox)
{
    std::vector<Aabb> boxes;
    for (int i = 0; i < 400; ++i)
        boxes.push_back(
            boxAt(0, 10.0f * static_cast<float>(i % 20) + 5, 10.0f * static_cast<float>(i / 20) + 5, 0.1f));
    ThesisOptions options = withCells(ThesisCells::FixedCount, 400);
    options.axis = PsapAxis::X;
    EXPECT_EQ(searchOnce(boxes, options).tests, 0u);
    options.cellCount = 1;
    EXPECT_EQ(searchOnce(boxes, options).tests, 400u * 399 / 2);
}

TEST(PsapSearch, MakesEightTimesFewerTestsWithBitStrings)
{
    SCOPED_TRACE("seed 4");
    Random random(4);
    const std::vector<Aabb> boxes = uniformCubes(20000, 60, random);
    ThesisOptions options = withCells(ThesisCells::FixedCount, 16);
    const Work without = searchOnce(boxes, options);
    options.bitStrings = true;
    const Work with = searchOnce(boxes, options);
    EXPECT_EQ(with.pairs, without.pairs);
    EXPECT_GT(with.pairs, 1000u);
    EXPECT_LT(with.tests * 8, without.tests);
}

TEST(PsapSearch, BoundsTestsPerIndexWhenWorkIsSplit)
{
    SCOPED_TRACE("seed 5");
    Random random(5);
    std::vector<Aabb> boxes = uniformCubes(5000, 60, random);
    boxes.push_back(cube(-1, 61));
    ThesisOptions options = withCells(ThesisCells::FixedCount, 4);
    const Work whole = searchOnce(boxes, options);
    options.splitWork = true;
    const Work split = searchOnce(boxes, options);
    EXPECT_EQ(split.pairs, whole.pairs);
    EXPECT_EQ(split.tests, whole.tests);
    EXPECT_GT(whole.mostTests, 1000u) << "the giant sweeps over a whole cell";
    EXPECT_EQ(split.mostTests, psap::kSweepPart);
}

TEST(PsapSearch, FindsMoreFalsePairsWithMoreCellsWhenShiftingInFloat)
{
    SCOPED_TRACE("seed 6");
    Random random(6);
    const std::vector<Aabb> boxes = uniformCubes(20000, 60, random);
    ThesisOptions options = withCells(ThesisCells::FixedCount, 1);
    options.isShifted = true;
    const Work one = searchOnce(boxes, options);
    EXPECT_EQ(one.falsePairs, 0u);
    options.cellCount = 256;
    const Work some = searchOnce(boxes, options);
    options.cellCount = 65536;
    const Work many = searchOnce(boxes, options);
    EXPECT_EQ(some.pairs, one.pairs);
    EXPECT_EQ(many.pairs, one.pairs);
    EXPECT_GT(some.falsePairs, 0u);
    EXPECT_GT(many.falsePairs, 100 * some.falsePairs);
    EXPECT_EQ(searchOnce(boxes, withCells(ThesisCells::FixedCount, 65536)).falsePairs, 0u);
}

TEST(PsapSearch, FindsAllPairsAlongPrincipalAxisWhenShiftingIsAsked)
{
    SCOPED_TRACE("seed 7");
    Random random(7);
    const std::vector<Aabb> boxes = slantedSlab(2000, random);
    ThesisOptions options = withCells(ThesisCells::FixedCount, 20);
    const Work plain = searchOnce(boxes, options);
    EXPECT_GT(plain.pairs, 20u);
    options.isShifted = true;
    options.isAxisPrincipal = true;
    EXPECT_EQ(searchOnce(boxes, options).pairs, plain.pairs);
}
}  // namespace
}  // namespace cullet::test
