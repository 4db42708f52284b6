// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/shapes/convex_shape.h"
#include "cullet/tests/plugin/convex/convex_contacts.h"
#include "cullet/tests/plugin/convex/convex_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <new>
#include <vector>

namespace cullet::test
{
namespace
{
/// Distance to a box below, by an algorithm that keeps its cache between calls.
class HeightProbe
{
public:
    explicit HeightProbe(btConvexHullShape& shape, const IsaGjkOptions& options = {})
        : m_bench(false, options), m_probe(m_bench.dispatcher, shape, m_ground, BT_CLOSEST_POINT_ALGORITHMS)
    {
        m_probe.place(vec(0, 3, 0), vec(0, 0, 0));
    }
    /// Height of the lowest point of the hull.
    double lowest()
    {
        const std::vector<Reported> points = m_probe.query(10);
        EXPECT_EQ(points.size(), 1u);
        return points.empty() ? -99 : points[0].distance + double(margin()) + 0.5 - 3;
    }
    /// Whether a step has no contact at this height.
    bool isApart() { return m_probe.query(0).empty(); }
    void setShape(btCollisionShape& shape) { m_probe.bodyA.setCollisionShape(&shape); }

private:
    btScalar margin() const { return m_probe.bodyA.getCollisionShape()->getMargin(); }
    ConvexBench m_bench;
    btBoxShape m_ground{vec(5, 0.5, 5)};
    ConvexPairProbe m_probe;
};
}  // namespace

TEST(HullCache, DetectsEveryFlippedBitWhenComparingPoints)
{
    constexpr std::size_t kWords = 70;
    std::vector<std::uint64_t> a(kWords), b;
    for (std::size_t i = 0; i < kWords; ++i)
        a[i] = 0x9e3779b97f4a7c15u * (i + 1);
    b = a;
    EXPECT_TRUE(areEqualBytes(nullptr, nullptr, 0));
    for (std::size_t words = 1; words < kWords; ++words)
    {
        EXPECT_TRUE(areEqualBytes(a.data(), b.data(), 8 * words));
        for (std::size_t bit = 0; bit < 64 * kWords; ++bit)
        {
            b[bit / 64] ^= std::uint64_t(1) << bit % 64;
            EXPECT_EQ(areEqualBytes(a.data(), b.data(), 8 * words), bit / 64 >= words) << words << ' ' << bit;
            b[bit / 64] = a[bit / 64];
        }
    }
}

TEST(HullCache, NoticesEveryEditOfShapeInPlace)
{
    auto shape = makeHullShape(ballPoints(60, 0.5, 1));
    shape->addPoint(vec(0, -0.7, 0));
    HeightProbe probe(*shape);
    EXPECT_NEAR(probe.lowest(), -0.7, 1e-5);
    shape->addPoint(vec(0.1, -0.9, 0));
    EXPECT_NEAR(probe.lowest(), -0.9, 1e-5);
    // A point moves inside the box of the shape, so neither count nor box change.
    shape->getUnscaledPoints()[61].setY(btScalar(-0.8));
    shape->addPoint(vec(0.3, -0.2, 0));
    EXPECT_NEAR(probe.lowest(), -0.8, 1e-5);
    shape->getUnscaledPoints()[61].setY(btScalar(-0.75));
    EXPECT_NEAR(probe.lowest(), -0.75, 1e-5);
    shape->optimizeConvexHull();
    EXPECT_NEAR(probe.lowest(), -0.75, 1e-3);
    shape->setLocalScaling(vec(1, 2, 1));
    EXPECT_NEAR(probe.lowest(), -1.5, 1e-3);
    shape->setLocalScaling(vec(1, -1, 3));
    double highest = 0;
    for (int i = 0; i < shape->getNumPoints(); ++i)
        highest = std::max(highest, double(shape->getUnscaledPoints()[i].y()));
    EXPECT_NEAR(probe.lowest(), -highest, 1e-5);
    shape->setLocalScaling(vec(1, 1, 1));
    shape->setMargin(btScalar(0.2));
    EXPECT_NEAR(probe.lowest(), -0.75, 1e-3);
}

TEST(HullCache, DistinguishesNewShapeAtAddressOfOldOne)
{
    alignas(64) unsigned char memory[sizeof(btConvexHullShape)];
    auto* shape = new (memory) btConvexHullShape;
    for (const btVector3& point : boxPoints(0.5, 0.5, 0.5))
        shape->addPoint(point);
    HeightProbe probe(*shape);
    EXPECT_NEAR(probe.lowest(), -0.5, 1e-6);
    shape->~btConvexHullShape();
    shape = new (memory) btConvexHullShape;
    for (const btVector3& point : boxPoints(0.5, 0.25, 0.5))
        shape->addPoint(point);
    EXPECT_NEAR(probe.lowest(), -0.25, 1e-6);
    shape->~btConvexHullShape();
}

TEST(HullCache, SharesOneGraphAmongShapesWithEqualPoints)
{
    const HullCacheStats before = hullCacheStats();
    std::vector<std::unique_ptr<btConvexHullShape>> shapes;
    std::vector<std::unique_ptr<HeightProbe>> probes;
    for (int i = 0; i < 50; ++i)
    {
        shapes.push_back(makeHullShape(ballPoints(30, 0.5, 77)));
        probes.push_back(std::make_unique<HeightProbe>(*shapes.back()));
        prepare(*shapes.back());
        probes.back()->lowest();
    }
    const HullCacheStats after = hullCacheStats();
    EXPECT_EQ(after.buildsTotal, before.buildsTotal + 1);
    EXPECT_GE(after.shapes, 50u);
    // One shape is edited; the others keep their contents.
    shapes[7]->addPoint(vec(0, -2, 0));
    EXPECT_NEAR(probes[7]->lowest(), -2, 1e-5);
    EXPECT_GT(probes[8]->lowest(), -0.6);
    prepare(*shapes[7]);
    EXPECT_EQ(hullCacheStats().buildsTotal, before.buildsTotal + 2);
    for (const auto& shape : shapes)
        invalidate(*shape);
}

/// Bodies of hulls fall onto each other; the fourth components of their points begin with `fourth`.
std::uint64_t hashOfHeap(Narrow narrow, btScalar fourth)
{
    ConvexWorld world(narrow);
    btBoxShape ground(vec(20, 1, 20));
    world.add(&ground, 0, vec(0, -1, 0));
    std::vector<std::unique_ptr<btConvexHullShape>> shapes;
    for (int i = 0; i < 8; ++i)
    {
        // Two of each, which share their points or, with other fourth components, do not.
        shapes.push_back(makeHullShape(i % 4 < 2 ? ballPoints(30, 0.5, std::uint32_t(90 + i % 4))
                                                 : boxPoints(0.4, 0.1 * (i % 4), 0.3)));
        btVector3* const points = shapes.back()->getUnscaledPoints();
        for (int point = 0; fourth != 0 && point < shapes.back()->getNumPoints(); ++point)
            points[point][3] = fourth * btScalar(point + i);
        world.add(shapes.back().get(), 1, vec(0.3 * (i % 2), 0.6 + 0.9 * i, 0.2 * (i % 3)));
    }
    world.step(120);
    EXPECT_GT(world.dispatcher().getNumManifolds(), 8);
    return hashOfBodies(world.bodies);
}

TEST(HullCache, ComputesSameContactsWhateverFourthComponentsOfPoints)
{
    constexpr btScalar kNan = std::numeric_limits<btScalar>::quiet_NaN();
    for (const Narrow narrow : {Narrow::IsaGjk, Narrow::Dispatcher})
    {
        const std::uint64_t expected = hashOfHeap(narrow, 0);
        EXPECT_EQ(hashOfHeap(narrow, btScalar(1e30)), expected);
        EXPECT_EQ(hashOfHeap(narrow, kNan), expected);
    }
}

TEST(HullCache, BuildsGraphOfPreparedShapeOnlyOnce)
{
    auto shape = makeHullShape(ballPoints(200, 0.5, 1234));
    const std::uint64_t before = hullCacheStats().buildsTotal;
    prepare(*shape);
    EXPECT_EQ(hullCacheStats().buildsTotal, before + 1);
    for (int i = 0; i < 3; ++i)
        HeightProbe(*shape).lowest();
    EXPECT_EQ(hullCacheStats().buildsTotal, before + 1);
    invalidate(*shape);
}

TEST(HullCache, ForgetsShapesThatNobodyUses)
{
    // All exist at the same time; otherwise addresses would be reused.
    std::vector<btConvexHullShape> shapes(20000);
    for (const btConvexHullShape& shape : shapes)
    {
        HullUse use;
        EXPECT_NE(use.hullOf(shape, 0), nullptr);
    }
    EXPECT_LT(hullCacheStats().shapes, 9000u);
}

TEST(HullCache, BoundsNumberOfPointSetsWhenShapeIsEditedRepeatedly)
{
    auto shape = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    HullUse use;
    const std::uint64_t before = hullCacheStats().buildsTotal, pointSets = hullCacheStats().pointSets;
    std::uint64_t most = 0;
    constexpr int kEdits = 10000;
    for (int i = 0; i < kEdits; ++i)
    {
        shape->getUnscaledPoints()[0].setX(btScalar(-1 - 1e-4 * i));
        ASSERT_NE(use.hullOf(*shape, 0), nullptr);
        most = std::max(most, hullCacheStats().pointSets);
    }
    EXPECT_EQ(hullCacheStats().buildsTotal, before);
    EXPECT_LE(most, pointSets + 3);
}

TEST(HullCache, ForgetsUnusedGraphsSoonerWhenTheyAreLarge)
{
    trimHullCache();
    const std::uint64_t before = hullCacheStats().graphs;
    std::vector<std::unique_ptr<btConvexHullShape>> shapes;
    std::uint64_t most = 0;
    for (unsigned i = 0; i < 320; ++i)
    {
        shapes.push_back(makeHullShape(ballPoints(1000, 0.5, 1000 + i)));
        HullUse use;
        ASSERT_NE(use.graphOf(*shapes.back(), 0), nullptr);
        // A graph of before may be gone too.
        most = std::max(most, std::max(hullCacheStats().graphs, before) - before);
    }
    EXPECT_GT(most, 10u);
    EXPECT_LT(most, 300u);
}

TEST(HullCache, ReleasesOnlyUnusedGraphsOnInvalidateAndTrim)
{
    trimHullCache();
    auto used = makeHullShape(ballPoints(40, 0.5, 2001)), unused = makeHullShape(ballPoints(40, 0.5, 2002)),
         kept = makeHullShape(ballPoints(40, 0.5, 2003));
    // Of an earlier test: the history of a destroyed shape at the address, which says whether a graph pays.
    for (const btConvexHullShape* shape : {used.get(), unused.get(), kept.get()})
        invalidate(*shape);
    const HullCacheStats before = hullCacheStats();
    HullUse use;
    use.hullOf(*used, 0);
    HullUse().hullOf(*unused, 0);
    prepare(*kept);
    EXPECT_EQ(hullCacheStats().graphs, before.graphs + 3);
    invalidate(*used);
    EXPECT_EQ(hullCacheStats().graphs, before.graphs + 3);
    invalidate(*unused);
    EXPECT_EQ(hullCacheStats().graphs, before.graphs + 2);
    EXPECT_EQ(hullCacheStats().shapes, before.shapes + 2);
    HullUse().hullOf(*unused, 0);
    trimHullCache();
    EXPECT_EQ(hullCacheStats().graphs, before.graphs + 2);
    EXPECT_EQ(hullCacheStats().pointSets, hullCacheStats().graphs);
    // Still the graph used by the pair and the prepared one.
    const std::uint64_t builds = hullCacheStats().buildsTotal;
    EXPECT_NE(use.hullOf(*used, 0), nullptr);
    EXPECT_NE(HullUse().hullOf(*kept, 0), nullptr);
    EXPECT_EQ(hullCacheStats().buildsTotal, builds);
    invalidate(*kept);
    use.reset();
    trimHullCache();
    EXPECT_EQ(hullCacheStats().graphs, before.graphs);
}

TEST(HullCache, BuildsNoGraphOfAHullThatChangesThoughItTouches)
{
    auto shape = makeHullShape(ballPoints(32, 0.5, 11));
    shape->addPoint(vec(0, -0.7, 0));
    ConvexBench bench;
    btBoxShape ground(vec(5, 0.5, 5));
    ConvexPairProbe probe(bench.dispatcher, *shape, ground);
    const std::uint64_t before = hullCacheStats().buildsTotal;
    for (int i = 0; i < 100; ++i)
    {
        shape->getUnscaledPoints()[i % 32].setX(btScalar(0.3 - 1e-3 * i));
        probe.place(vec(0, i % 2 == 0 ? 3 : 1.2, 0), vec(0, 0, 0));
        EXPECT_EQ(probe.query().empty(), i % 2 == 0);
    }
    EXPECT_EQ(hullCacheStats().buildsTotal, before);
}

TEST(HullCache, BuildsAGraphWhenContactsHaveCostAsMuch)
{
    const auto shape = makeHullShape(ballPoints(32, 0.5, 16));
    HeightProbe probe(*shape);
    const std::uint64_t before = hullCacheStats().buildsTotal;
    std::uint32_t contacts = 0;
    for (; contacts < 1000 && hullCacheStats().buildsTotal == before; ++contacts)
        EXPECT_NEAR(probe.lowest(), -0.5, 0.1);
    EXPECT_GE(contacts, HullCache::kLeastScans / HullCache::kScansOfContact);
    EXPECT_LE(contacts, (HullCache::kLeastScans + HullCache::kScanSpread) / HullCache::kScansOfContact + 1);
}

TEST(HullCache, BuildsNoGraphOfAHullThatTouchesNothing)
{
    std::mt19937 engine(19);
    const auto shape = makeHullShape(ballPoints(32, 0.5, 17)), other = makeHullShape(ballPoints(32, 0.5, 18));
    ConvexBench bench;
    ConvexPairProbe probe(bench.dispatcher, *shape, *other);
    const std::uint64_t before = hullCacheStats().buildsTotal;
    // More tests than a hull has contacts before it gets a graph; from all sides, so that each searches anew.
    for (int i = 0; i < 100; ++i)
    {
        probe.place(quatRotate(randomRotation(engine), vec(3, 0, 0)), vec(0, 0, 0));
        EXPECT_TRUE(probe.query().empty());
    }
    EXPECT_EQ(bench.registration->stats().separatedTotal, 100u);
    EXPECT_EQ(hullCacheStats().buildsTotal, before);
}

TEST(HullCache, BuildsAGraphOfVeryManyPointsOnlyWhenItIsPrepared)
{
    std::vector<btVector3> points = ballPoints(HullCache::kMostBuilt, 0.5, 12);
    points.push_back(vec(0, -0.7, 0));
    const auto shape = makeHullShape(points), other = makeHullShape(points);
    const std::uint64_t before = hullCacheStats().buildsTotal;
    EXPECT_NEAR(HeightProbe(*shape).lowest(), -0.7, 1e-5);
    EXPECT_EQ(hullCacheStats().buildsTotal, before);
    prepare(*shape);
    EXPECT_EQ(hullCacheStats().buildsTotal, before + 1);
    HullUse use, ofOther;
    EXPECT_EQ(use.graphOf(*shape, 0)->kind(), HullKind::Solid);
    EXPECT_EQ(ofOther.graphOf(*other, 0)->kind(), HullKind::Cloud);
    EXPECT_NEAR(HeightProbe(*shape).lowest(), -0.7, 1e-5);
    invalidate(*shape);
    EXPECT_EQ(use.graphOf(*shape, 0)->kind(), HullKind::Cloud);
    EXPECT_NEAR(HeightProbe(*shape).lowest(), -0.7, 1e-5);
    EXPECT_EQ(hullCacheStats().buildsTotal, before + 1);
}

TEST(HullCache, BuildsNoGraphOfAShapeThatIsDeforming)
{
    // Level faces, for which a contact needs a graph.
    auto shape = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    ConvexBench bench;
    btBoxShape ground(vec(5, 0.5, 5));
    ConvexPairProbe probe(bench.dispatcher, *shape, ground);
    const auto pointsAt = [&](double height)
    {
        for (int i = 0; i < 8; ++i)
            shape->getUnscaledPoints()[i].setY(
                btScalar(std::copysign(height, shape->getUnscaledPoints()[i].y())));
        probe.place(vec(0, 0.5 + height, 0), vec(0, 0, 0));
        return probe.step()->getNumContacts();
    };
    setDeforming(*shape);
    const std::uint64_t before = hullCacheStats().buildsTotal;
    for (int i = 0; i < 20; ++i)
        EXPECT_GE(pointsAt(0.5 + 0.01 * i), 1);
    EXPECT_EQ(hullCacheStats().buildsTotal, before);
    setDeforming(*shape, false);
    EXPECT_EQ(pointsAt(0.3), 4);
    EXPECT_EQ(hullCacheStats().buildsTotal, before + 1);
    setDeforming(*shape);
    invalidate(*shape);
    HullUse use;
    EXPECT_EQ(use.graphOf(*shape, 0)->kind(), HullKind::Solid);
}

TEST(HullCache, RemembersThatAShapeIsDeformingWhileNoPairUsesIt)
{
    const auto shape = makeHullShape(ballPoints(30, 0.5, 15)), other = makeHullShape(ballPoints(30, 0.5, 16));
    setDeforming(*shape);
    trimHullCache();
    HullUse use, ofOther;
    EXPECT_EQ(use.graphOf(*shape, 0)->kind(), HullKind::Cloud);
    EXPECT_EQ(ofOther.graphOf(*other, 0)->kind(), HullKind::Solid);
    invalidate(*shape);
}

TEST(HullCache, BuildsAGraphWhenScansHaveCostAsMuch)
{
    const auto large = makeHullShape(ballPoints(100, 0.5, 13)),
               small = makeHullShape(ballPoints(20, 0.5, 14));
    HullUse ofLarge, ofSmall;
    std::uint32_t scans = 0;
    for (; scans < 10000 && ofLarge.hullOf(*large, 0)->kind() == HullKind::Cloud; ++scans)
        EXPECT_EQ(ofSmall.hullOf(*small, 0)->kind(), HullKind::Cloud);
    EXPECT_GE(scans, HullCache::kLeastScans);
    EXPECT_LE(scans, HullCache::kLeastScans + HullCache::kScanSpread);
    EXPECT_EQ(ofLarge.hullOf(*large, 0)->kind(), HullKind::Solid);
    // A change resets the count.
    large->getUnscaledPoints()[0].setX(btScalar(0.6));
    EXPECT_EQ(ofLarge.hullOf(*large, 0)->kind(), HullKind::Cloud);
}

TEST(HullCache, NoticesEditOnlyAfterInvalidateWhenPointChecksAreOff)
{
    auto shape = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    IsaGjkOptions options;
    options.checkPoints = false;
    HeightProbe probe(*shape, options);
    EXPECT_NEAR(probe.lowest(), -0.5, 1e-6);
    for (int i = 0; i < 8; ++i)
        shape->getUnscaledPoints()[i].setY(shape->getUnscaledPoints()[i].y() / 2);
    EXPECT_NEAR(probe.lowest(), -0.5, 1e-6);
    invalidate(*shape);
    EXPECT_NEAR(probe.lowest(), -0.25, 1e-6);
}

TEST(HullCache, MatchesSupportOfBulletsScanForPosedShapes)
{
    std::mt19937 engine(5);
    std::vector<std::vector<btVector3>> sets = {ballPoints(12, 0.5, 1), ballPoints(42, 0.5, 2),
                                                ballPoints(300, 0.5, 3), boxPoints(0.5, 0.2, 0.3),
                                                boxPoints(0.5, 0, 0.3)};
    // Duplicates, inner points, a grid in one plane, a prism with many sides, a segment, a point.
    sets.push_back(sets[1]);
    sets.back().insert(sets.back().end(), sets[1].begin(), sets[1].end());
    for (const btVector3& point : ballPoints(100, 0.2, 4))
        sets.back().push_back(point);
    sets.emplace_back();
    for (int i = 0; i < 98; ++i)
        sets.back().push_back(vec(0.1 * (i % 7), i < 49 ? 0.0 : 0.4, 0.1 * (i / 7 % 7)));
    sets.emplace_back();
    for (int i = 0; i < 1000; ++i)
        sets.back().push_back(vec(std::cos(i / 2 * 0.0125663706), i % 2, std::sin(i / 2 * 0.0125663706)));
    sets.push_back({vec(0, 0, 0), vec(1, 1, 1), vec(0.5, 0.5, 0.5)});
    sets.push_back({vec(0.3, 0.1, 0.2)});
    std::normal_distribution<double> normal;
    const double scales[][3] = {{1, 1, 1}, {2, 0.5, 1}, {1, -1, 1}, {-3, -0.1, -1}};
    for (const auto& points : sets)
    {
        auto shape = makeHullShape(points);
        HullUse use;
        for (const auto& scale : scales)
        {
            shape->setLocalScaling(vec(scale[0], scale[1], scale[2]));
            const btTransform place(randomRotation(engine), vec(3, -2, 1));
            const auto posed = poseShape(*shape, ConvexKind::Hull, place, use, 0);
            ASSERT_TRUE(posed.has_value());
            double size = 0;
            for (const btVector3& point : points)
                size = std::max(size, double((point * shape->getLocalScaling()).length()));
            std::int32_t last = -1;
            for (int i = 0; i < 500; ++i)
            {
                // From z to x: in the order in which GCC evaluates arguments.
                const double z = normal(engine), y = normal(engine), x = normal(engine);
                Eigen::Vector3d direction(x, y, z);
                if (i % 5 == 0)
                    direction = place.getBasis()[i / 5 % 3].x() > 0 ? Eigen::Vector3d::UnitY()
                                                                    : Eigen::Vector3d::UnitX();
                direction.normalize();
                const SupportPoint ours = posed->support(direction, last);
                last = ours.vertex;
                const btVector3 local = toBullet(direction) * place.getBasis();
                const btVector3 theirs =
                    place.getBasis() * shape->localGetSupportVertexWithoutMarginNonVirtual(local);
                const double best = double(theirs.dot(toBullet(direction)));
                ASSERT_NEAR(ours.point.dot(direction), best,
                            8 * double(std::numeric_limits<btScalar>::epsilon()) * size);
            }
        }
    }
}
}  // namespace cullet::test
