// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/backends.h"
#include "cullet/plugin/proxies/debug_draw.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <tuple>

namespace cullet::test
{
namespace
{
struct Line
{
    btVector3 from, to, color;
};

class LineCollector : public btIDebugDraw
{
public:
    void drawLine(const btVector3& from, const btVector3& to, const btVector3& color) override
    {
        lines.push_back({from, to, color});
    }
    void drawContactPoint(const btVector3&, const btVector3&, btScalar, int, const btVector3&) override {}
    void reportErrorWarning(const char*) override {}
    void draw3dText(const btVector3&, const char*) override {}
    void setDebugMode(int) override {}
    int getDebugMode() const override { return 0; }

    std::vector<Line> lines;
};

DebugDrawOptions only(bool boxes, bool cells, bool pairs)
{
    DebugDrawOptions options;
    options.boxes = boxes;
    options.cells = cells;
    options.pairs = pairs;
    return options;
}

std::vector<Line> draw(const Broadphase& broadphase, const DebugDrawOptions& options)
{
    LineCollector collector;
    broadphase.debugDraw(collector, options);
    return collector.lines;
}

using Box = std::array<btScalar, 6>;

/// The boxes formed by the lines, twelve lines each.
std::vector<Box> boxesOf(const std::vector<Line>& lines)
{
    EXPECT_EQ(lines.size() % 12, 0u);
    std::vector<Box> boxes;
    for (std::size_t first = 0; first + 12 <= lines.size(); first += 12)
    {
        btVector3 min = lines[first].from, max = min;
        for (std::size_t i = first; i < first + 12; ++i)
        {
            for (const btVector3& end : {lines[i].from, lines[i].to})
            {
                min.setMin(end);
                max.setMax(end);
            }
        }
        boxes.push_back({min.x(), min.y(), min.z(), max.x(), max.y(), max.z()});
    }
    return boxes;
}

/// A field of evenly spread cubes, some of which overlap.
struct Field
{
    explicit Field(std::unique_ptr<Backend> backend) : broadphase(std::move(backend))
    {
        std::mt19937 random(5);
        std::uniform_real_distribution<float> place(-20, 20);
        for (int i = 0; i < 1000; ++i)
        {
            // From z to x: in the order in which GCC evaluates arguments.
            const float z = place(random) / 4, y = place(random) / 2, x = place(random);
            proxies.push_back(addCube(broadphase, vec(x, y, z), 0.375));
        }
        broadphase.calculateOverlappingPairs(nullptr);
    }

    Broadphase broadphase;
    std::vector<btBroadphaseProxy*> proxies;
};

/// btIDebugDraw::drawAabb() converts to centre and half extents, which rounds.
constexpr double kRounding = 1e-4;

bool isNear(btScalar a, btScalar b)
{
    return std::abs(a - b) <= kRounding;
}

bool covers(const std::vector<Box>& boxes, const btVector3& point)
{
    for (const Box& box : boxes)
    {
        bool isInside = true;
        for (int axis = 0; axis < 3; ++axis)
            isInside &= point[axis] >= box[axis] - kRounding && point[axis] <= box[axis + 3] + kRounding;
        if (isInside)
            return true;
    }
    return false;
}
}  // namespace

TEST(DebugDraw, DrawsABoxForEachBodyColouredByPairsAndALineForEachPair)
{
    Broadphase broadphase(bruteOptions());
    addCube(broadphase, vec(0, 0, 0));
    addCube(broadphase, vec(0.75, 0.5, 0));
    addCube(broadphase, vec(10, 0, 0), 2);
    broadphase.calculateOverlappingPairs(nullptr);
    const DebugDrawOptions colors;

    const std::vector<Line> boxes = draw(broadphase, only(true, false, false));
    const std::vector<Box> expected = {Box{-0.5, -0.5, -0.5, 0.5, 0.5, 0.5}, Box{0.25, 0, -0.5, 1.25, 1, 0.5},
                                       Box{8, -2, -2, 12, 2, 2}};
    EXPECT_EQ(boxesOf(boxes), expected);
    ASSERT_EQ(boxes.size(), 36u);
    EXPECT_EQ(boxes[0].color, colors.pairedBoxColor);
    EXPECT_EQ(boxes[12].color, colors.pairedBoxColor);
    EXPECT_EQ(boxes[24].color, colors.boxColor);

    const std::vector<Line> pairs = draw(broadphase, only(false, false, true));
    ASSERT_EQ(pairs.size(), 1u);
    EXPECT_EQ(pairs[0].from, vec(0, 0, 0));
    EXPECT_EQ(pairs[0].to, vec(0.75, 0.5, 0));
    EXPECT_EQ(pairs[0].color, colors.pairColor);

    LineCollector collector;
    broadphase.debugDraw(collector);
    EXPECT_EQ(collector.lines.size(), 37u) << "boxes and pairs without options";
    EXPECT_TRUE(draw(broadphase, only(false, false, false)).empty());
}

TEST(DebugDraw, DrawsNothingOfAnEmptyBroadphase)
{
    EXPECT_TRUE(draw(Broadphase(), only(true, true, true)).empty());
}

TEST(DebugDraw, CutsUnboundedBoxesAtTheBoundsOfTheOthersAndLeavesInvalidOnesOut)
{
    Broadphase broadphase(bruteOptions());
    const btScalar far = btScalar(1e18);
    addCube(broadphase, vec(1, 2, 3));
    broadphase.createProxy(vec(-far, -far, -far), vec(far, 1.75, far), 0, nullptr, 1, -1, nullptr);
    broadphase.createProxy(vec(5, 5, 5), vec(4, 4, 4), 0, nullptr, 1, -1, nullptr);
    const btScalar nan = std::numeric_limits<btScalar>::quiet_NaN();
    broadphase.createProxy(vec(0, nan, 0), vec(1, 1, 1), 0, nullptr, 1, -1, nullptr);
    broadphase.calculateOverlappingPairs(nullptr);

    const std::vector<Box> expected = {Box{0.5, 1.5, 2.5, 1.5, 2.5, 3.5}, Box{0.5, 1.5, 2.5, 1.5, 1.75, 3.5}};
    EXPECT_EQ(boxesOf(draw(broadphase, only(true, false, false))), expected);
    EXPECT_EQ(draw(broadphase, only(false, false, true)).size(), 1u);
}

TEST(DebugDraw, EndsLineToMuchLargerBoxAtItsNearestPoint)
{
    Broadphase broadphase(bruteOptions());
    broadphase.createProxy(vec(-100, -1, -100), vec(100, 0, 100), 0, nullptr, 1, -1, nullptr);
    addCube(broadphase, vec(30, 0.25, 40));
    broadphase.calculateOverlappingPairs(nullptr);
    const std::vector<Line> pairs = draw(broadphase, only(false, false, true));
    ASSERT_EQ(pairs.size(), 1u);
    EXPECT_EQ(pairs[0].from, vec(30, 0, 40));
    EXPECT_EQ(pairs[0].to, vec(30, 0.25, 40));
}

TEST(DebugDraw, DrawsColumnsThatCoverBoxesAndReachFromEndToEnd)
{
    GridOptions grid;
    grid.flatLimit = 0;
    grid.cellScale = 3;
    Field field(makeGridBackend(grid));
    const std::vector<Line> lines = draw(field.broadphase, only(false, true, false));
    const std::vector<Box> cells = boxesOf(lines);
    ASSERT_GT(cells.size(), 20u);
    EXPECT_EQ(lines[0].color, DebugDrawOptions().cellColor);
    EXPECT_EQ(std::set<Box>(cells.begin(), cells.end()).size(), cells.size()) << "a cell is there twice";

    btVector3 min, max;
    field.broadphase.getBroadphaseAabb(min, max);
    int fullAxes = 0;
    for (int axis = 0; axis < 3; ++axis)
    {
        fullAxes += std::all_of(cells.begin(), cells.end(),
                                [&](const Box& cell) {
                                    return isNear(cell[axis], min[axis]) && isNear(cell[axis + 3], max[axis]);
                                });
    }
    EXPECT_EQ(fullAxes, 1) << "rows are cut along two axes";
    for (const btBroadphaseProxy* proxy : field.proxies)
    {
        ASSERT_TRUE(covers(cells, proxy->m_aabbMin));
        ASSERT_TRUE(covers(cells, proxy->m_aabbMax));
    }
}

TEST(DebugDraw, DrawsCubicCellsThatCoverBoxCentres)
{
    Field field(makeCellGridBackend());
    const std::vector<Box> cells = boxesOf(draw(field.broadphase, only(false, true, false)));
    btVector3 min, max;
    field.broadphase.getBroadphaseAabb(min, max);
    std::size_t whole = 0;
    for (const Box& cell : cells)
    {
        bool isCut = false;
        for (int axis = 0; axis < 3; ++axis)
            isCut |= isNear(cell[axis], min[axis]) || isNear(cell[axis + 3], max[axis]);
        if (isCut)
            continue;
        ++whole;
        EXPECT_NEAR(cell[3] - cell[0], 1, kRounding);
        EXPECT_NEAR(cell[4] - cell[1], 1, kRounding);
        EXPECT_NEAR(cell[5] - cell[2], 1, kRounding);
    }
    EXPECT_GT(whole, 100u);
    for (const btBroadphaseProxy* proxy : field.proxies)
        ASSERT_TRUE(covers(cells, (proxy->m_aabbMin + proxy->m_aabbMax) / 2));
}

TEST(DebugDraw, DrawsNoCellsForBackendsWithoutThem)
{
    Broadphase brute(bruteOptions());
    addCube(brute, vec(0, 0, 0));
    brute.calculateOverlappingPairs(nullptr);
    EXPECT_TRUE(draw(brute, only(false, true, false)).empty());
    Broadphase few;  // flat arrays
    addCube(few, vec(0, 0, 0));
    few.calculateOverlappingPairs(nullptr);
    EXPECT_TRUE(draw(few, only(false, true, false)).empty());
}

TEST(DebugDraw, IgnoresProxiesOfAnotherBroadphaseInCache)
{
    btHashedOverlappingPairCache cache;
    Broadphase broadphase(&cache, bruteOptions());
    StockBroadphase other;
    addCube(broadphase, vec(0, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    for (int i = 0; i < 50; ++i)
        addCube(other, vec(0, 0, 0));
    const btBroadphasePairArray& pairs = other.getOverlappingPairCache()->getOverlappingPairArray();
    ASSERT_GT(pairs.size(), 100);
    for (int i = 0; i < pairs.size(); ++i)
        cache.addOverlappingPair(pairs[i].m_pProxy0, pairs[i].m_pProxy1);
    EXPECT_EQ(boxesOf(draw(broadphase, only(true, false, false))).size(), 1u);
    while (cache.getNumOverlappingPairs() > 0)
        cache.removeOverlappingPair(cache.getOverlappingPairArray()[0].m_pProxy0,
                                    cache.getOverlappingPairArray()[0].m_pProxy1, nullptr);
}

TEST(DebugDraw, PassesLeastCornerOfEachBoxFirst)
{
    struct BoxCollector final : LineCollector
    {
        void drawAabb(const btVector3& from, const btVector3& to, const btVector3&) override
        {
            ++boxCount;
            for (int axis = 0; axis < 3; ++axis)
                EXPECT_LE(from[axis], to[axis]) << "box " << boxCount;
        }
        int boxCount = 0;
    };
    GridOptions grid;
    grid.flatLimit = 0;
    grid.cellScale = 3;
    const Field field(makeGridBackend(grid));
    BoxCollector bodies, cells;
    field.broadphase.debugDraw(bodies, only(true, false, false));
    field.broadphase.debugDraw(cells, only(false, true, false));
    EXPECT_EQ(bodies.boxCount, 1000);
    EXPECT_GT(cells.boxCount, 20);
}

TEST(DebugDraw, ColoursNoBoxByPairOfAnotherBroadphaseInCache)
{
    btHashedOverlappingPairCache cache;
    Broadphase broadphase(&cache, bruteOptions());
    Broadphase other(bruteOptions());
    for (const double x : {0.0, 5.0})
        addCube(broadphase, vec(x, 0, 0));
    btBroadphaseProxy* const a = addCube(other, vec(0, 0, 0));
    btBroadphaseProxy* const b = addCube(other, vec(0, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    cache.addOverlappingPair(a, b);
    const std::vector<Line> boxes = draw(broadphase, only(true, false, false));
    cache.removeOverlappingPair(a, b, nullptr);
    ASSERT_EQ(boxes.size(), 24u);
    for (const Line& line : boxes)
        EXPECT_EQ(line.color, DebugDrawOptions().boxColor);
}
}  // namespace cullet::test
