// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/distance_oracle.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/tests/plugin/convex/convex_contacts.h"
#include "cullet/tests/plugin/convex/core_oracle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace cullet::test
{
namespace
{
/// Distance of the cores, or minus the depth.
double exactDistance(const CoreOracle& a, const CoreOracle& b)
{
    const PosedHull<double> posedA = a.posed(), posedB = b.posed();
    GjkCache<double> cache;
    const auto near = gjkDistance(posedA, posedB, std::numeric_limits<double>::infinity(), cache);
    if (near.state == GjkState::Near)
        return near.distance;
    EXPECT_EQ(near.state, GjkState::Overlapping);
    const auto deep = penetration(posedA, posedB, cache);
    EXPECT_EQ(deep.state, GjkState::Overlapping);
    return -deep.depth;
}

btTransform randomPlace(std::mt19937& engine, double spread)
{
    std::uniform_real_distribution<double> place(-spread, spread);
    const double x = place(engine), y = place(engine), z = place(engine);
    return btTransform(randomRotation(engine), vec(x, y, z));
}

/// Distance of two boxes, or minus the depth, which is along a face normal or a cross product of edges.
double exactBoxDistance(const CoreOracle& a, const CoreOracle& b, const DistanceOracle& oracle)
{
    const Bounds bounds = oracle.solve();
    if (!bounds.isInside)
        return double(bounds.upper);
    const Eigen::Matrix3d axesA = a.posed().basis(), axesB = b.posed().basis();
    double depth = std::numeric_limits<double>::infinity();
    const auto tryAxis = [&](const Eigen::Vector3d& axis)
    {
        const LongVector direction = axis.cast<long double>();
        depth = std::min({depth, double(oracle.extent(direction)), double(oracle.extent(-direction))});
    };
    for (int i = 0; i < 3; ++i)
    {
        tryAxis(axesA.col(i));
        tryAxis(axesB.col(i));
        for (int k = 0; k < 3; ++k)
            tryAxis(axesA.col(i).cross(axesB.col(k)));
    }
    return -depth;
}
}  // namespace

TEST(IsaGjkQueries, MatchDistancesOfDoubleOracleWithoutWrongSign)
{
    ConvexBench bench;
    std::mt19937 engine(4711);
    std::vector<std::unique_ptr<btConvexHullShape>> shapes;
    for (const int count : {4, 8, 20, 42, 100})
        shapes.push_back(makeHullShape(ballPoints(count, 0.5, unsigned(count))));
    shapes.push_back(makeHullShape(boxPoints(0.5, 0.05, 0.3)));
    shapes.push_back(makeHullShape(boxPoints(0.02, 0.02, 0.6)));
    shapes.push_back(makeHullShape(boxPoints(0.5, 0.5, 0)));
    int apart = 0, overlapping = 0;
    for (int i = 0; i < 3000; ++i)
    {
        btConvexHullShape& a = *shapes[engine() % shapes.size()];
        btConvexHullShape& b = *shapes[engine() % shapes.size()];
        const btTransform atA = randomPlace(engine, 0.6), atB = randomPlace(engine, 0.6);
        const auto found = bench.closest(a, atA, b, atB, 10);
        ASSERT_TRUE(found.has_value()) << i;
        const double exact = exactDistance(CoreOracle(a, atA), CoreOracle(b, atB));
        const double core = found->distance + double(a.getMargin()) + double(b.getMargin());
        // Four roundings of the coordinates; depths in float are certified to 1e-5 of the size, in double to 1e-10.
        const bool isFloat = sizeof(btScalar) == sizeof(float);
        const double rounding = isFloat ? 2e-6 : 1e-12;
        const double tolerance = exact > 0 ? rounding : isFloat ? 2e-5 : 1e-10;
        EXPECT_NEAR(core, exact, tolerance) << i;
        if (std::abs(exact) > rounding)
        {
            EXPECT_EQ(core > 0, exact > 0) << i;
        }
        EXPECT_NEAR(double(found->normal.length()), 1.0, isFloat ? 1e-5 : 1e-12) << i;
        (exact > 0 ? apart : overlapping)++;
    }
    EXPECT_GT(apart, 600);
    EXPECT_GT(overlapping, 600);
    EXPECT_EQ(bench.registration->stats().notConvergedTotal, 0u);
}

TEST(IsaGjkQueries, MatchBulletsClosestPointsWithinThreshold)
{
    ConvexBench bench, stock(true);
    std::mt19937 engine(99);
    auto hull = makeHullShape(ballPoints(16, 0.5, 5));
    auto brick = makeHullShape(boxPoints(0.4, 0.3, 0.2));
    btBoxShape box(vec(0.4, 0.5, 0.3));
    btSphereShape sphere(btScalar(0.4));
    btCapsuleShape capsule(btScalar(0.3), btScalar(0.7));
    btCylinderShape cylinder(vec(0.4, 0.5, 0.4));
    const std::vector<btConvexShape*> shapes = {hull.get(), brick.get(), &box, &sphere, &capsule, &cylinder};
    int found = 0, nothing = 0, compared = 0;
    for (int i = 0; i < 3000; ++i)
    {
        btConvexShape& a = *shapes[engine() % shapes.size()];
        btConvexShape& b = *shapes[engine() % shapes.size()];
        const btTransform atA = randomPlace(engine, 1.2), atB = randomPlace(engine, 1.2);
        const double threshold = i % 3 == 0 ? 0 : 1;
        const auto ours = bench.closest(a, atA, b, atB, threshold);
        const auto theirs = stock.closest(a, atA, b, atB, threshold);
        // Bullet's search ends once the cores are farther apart than margins, breaking threshold and threshold
        // together, and reports its current value: up to twice the margins more, or nothing.
        const double reach = threshold + 0.008;
        if (ours.has_value() != theirs.has_value())
        {
            EXPECT_GT((ours ? ours : theirs)->distance, reach) << i;
            continue;
        }
        (ours ? found : nothing)++;
        if (!ours || ours->distance > reach || ours->distance < -0.02)
            continue;
        ++compared;
        EXPECT_NEAR(ours->distance, theirs->distance, 1e-2) << i << a.getName() << b.getName();
        if (ours->distance > 0.1)
        {
            EXPECT_GT(double(ours->normal.dot(theirs->normal)), 0.99) << i << a.getName() << b.getName();
        }
    }
    EXPECT_GT(compared, 600);
    EXPECT_GT(found, 1000);
    EXPECT_GT(nothing, 300);
}

TEST(IsaGjkQueries, ReportGapsUpToSameThresholdAsBullet)
{
    for (const bool isStock : {true, false})
    {
        ConvexBench bench(isStock);
        auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
        const auto at = [&](double gap, double threshold)
        {
            return bench.closest(*cube, btTransform(btQuaternion::getIdentity(), vec(0, 1 + gap, 0)), *cube,
                                 btTransform::getIdentity(), threshold);
        };
        // Twice 0.08 of margins, and the breaking threshold of about 0.019.
        EXPECT_TRUE(at(0.17, 0)) << isStock;
        EXPECT_FALSE(at(0.19, 0)) << isStock;
        EXPECT_TRUE(at(0.42, 0.25)) << isStock;
        EXPECT_FALSE(at(0.44, 0.25)) << isStock;
        EXPECT_NEAR(at(0.17, 0)->distance, 0.09, 1e-4) << isStock;
    }
}

TEST(IsaGjkQueries, AnswerEquallyWithReusedAndWithFreshAlgorithm)
{
    ConvexBench bench;
    // The relative threshold depends on the shapes at the creation of the manifold.
    bench.dispatcher.setDispatcherFlags(0);
    std::mt19937 engine(31);
    std::vector<std::unique_ptr<btConvexHullShape>> hulls;
    for (const int count : {6, 12, 42, 90})
        hulls.push_back(makeHullShape(ballPoints(count, 0.5, unsigned(count))));
    btBoxShape box(vec(0.5, 0.4, 0.3));
    std::vector<btConvexShape*> shapes = {&box};
    for (const auto& hull : hulls)
        shapes.push_back(hull.get());
    ConvexPairProbe probe(bench.dispatcher, *shapes[0], *shapes[1], BT_CLOSEST_POINT_ALGORITHMS);
    std::uniform_real_distribution<double> small(-0.02, 0.02);
    btTransform atA = randomPlace(engine, 0.8), atB = randomPlace(engine, 0.8);
    int found = 0, nothing = 0;
    for (int i = 0; i < 4000; ++i)
    {
        const unsigned event = engine() % 20;
        if (event == 0)
            probe.bodyA.setCollisionShape(shapes[engine() % shapes.size()]);
        else if (event == 1)
            probe.bodyB.setCollisionShape(shapes[engine() % shapes.size()]);
        else if (event == 2)
            atA = randomPlace(engine, 0.8);
        else if (event == 3)
        {
            // Swapped order.
            btCollisionShape* shape = probe.bodyA.getCollisionShape();
            probe.bodyA.setCollisionShape(probe.bodyB.getCollisionShape());
            probe.bodyB.setCollisionShape(shape);
            std::swap(atA, atB);
        }
        else if (event == 4)
        {
            const double s = 0.5 + double(engine() % 1000) / 1000;
            shapes[1]->setLocalScaling(vec(s, 1 / s, -s));
        }
        else if (event == 5)
            shapes[2]->setMargin(btScalar(double(engine() % 100) / 1000));
        else
            atB.setOrigin(atB.getOrigin() + drawVec(small, engine));
        probe.place(atA, atB);
        const double threshold = i % 2 == 0 ? 0.0 : 0.5;
        const std::vector<Reported> remembered = probe.query(threshold);
        auto& a = *probe.bodyA.getCollisionShape();
        auto& b = *probe.bodyB.getCollisionShape();
        const auto fresh = bench.closest(a, atA, b, atB, threshold);
        ASSERT_EQ(!remembered.empty(), fresh.has_value()) << i;
        (fresh ? found : nothing)++;
        // A depth is certified to 1e-5 of the size in float, from either tetrahedron, in double to 1e-10.
        if (fresh)
        {
            ASSERT_NEAR(remembered[0].distance, fresh->distance, sizeof(btScalar) == 4 ? 5e-5 : 5e-10) << i;
        }
    }
    EXPECT_GT(found, 1000);
    EXPECT_GT(nothing, 500);
}

TEST(IsaGjkQueries, GiveExactDepthAndNormalForExtremeSizesAndMargins)
{
    ConvexBench bench;
    for (const double size : {1e-3, 1.0, 1e3})
    {
        for (const double margin : {0.0, 0.04, 2.0})
        {
            auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
            cube->setLocalScaling(vec(size, size, size));
            cube->setMargin(btScalar(margin * size));
            for (const double gap : {-1.0, -0.5, -0.1, 0.0, 0.05})
            {
                // Coincident centres at -1: any face will do.
                const auto found = bench.closest(
                    *cube, btTransform(btQuaternion::getIdentity(), vec(0, (1 + gap) * size, 0)), *cube,
                    btTransform::getIdentity(), 10 * size);
                ASSERT_TRUE(found.has_value()) << size << ' ' << margin << ' ' << gap;
                EXPECT_NEAR(found->distance / size, gap - 2 * margin, 2e-5) << size << ' ' << margin;
                const btVector3 n = found->normal.absolute();
                EXPECT_NEAR(double(std::max({n.x(), n.y(), n.z()})), 1.0, 1e-4) << size << ' ' << gap;
            }
        }
    }
    // A pebble on a plate ten thousand times its size.
    auto pebble = makeHullShape(boxPoints(0.05, 0.05, 0.05));
    auto plate = makeHullShape(boxPoints(500, 1, 500));
    pebble->setMargin(0);
    plate->setMargin(0);
    for (const double height : {1.049, 1.05, 1.06})
    {
        const auto found =
            bench.closest(*pebble, btTransform(btQuaternion::getIdentity(), vec(321, height, -123)), *plate,
                          btTransform::getIdentity(), 1);
        ASSERT_TRUE(found.has_value());
        EXPECT_NEAR(found->distance, height - 1.05, 1e-6);
        EXPECT_GT(double(found->normal.y()), 0.999);
    }
    EXPECT_EQ(bench.registration->stats().notConvergedTotal, 0u);
}

TEST(IsaGjkQueries, MatchOracleForTurnedPebbleOnRockTenThousandTimesItsSize)
{
    ConvexBench bench;
    std::mt19937 engine(65);
    auto pebble = makeHullShape(boxPoints(0.05, 0.04, 0.03));
    auto rock = makeHullShape(boxPoints(500, 400, 300));
    pebble->setMargin(0);
    rock->setMargin(0);
    std::uniform_real_distribution<double> inside(-1, 1), gap(-0.08, 0.12);
    int apart = 0, overlapping = 0;
    // The error for coordinates of 700.
    const double tolerance = sizeof(btScalar) == sizeof(float) ? 4e-4 : 2e-8;
    for (int i = 0; i < 2000; ++i)
    {
        const btTransform atRock = randomPlace(engine, 100);
        // At a face, an edge or a corner of the rock.
        btVector3 local(0, 0, 0), away(0, 0, 0);
        for (int axis = 0; axis < 3; ++axis)
        {
            const double half = 500 - 100 * axis, place = inside(engine);
            if (axis <= i % 3)
                away[axis] = btScalar(place > 0 ? 1 : -1);
            local[axis] = axis <= i % 3 ? btScalar(half) * away[axis] : btScalar(half * place);
        }
        const btQuaternion turn = randomRotation(engine);
        const btTransform atPebble(turn, atRock(local + btScalar(gap(engine)) * away));
        const bool isSwapped = i % 2 == 1;
        const auto found = isSwapped ? bench.closest(*rock, atRock, *pebble, atPebble, 10)
                                     : bench.closest(*pebble, atPebble, *rock, atRock, 10);
        ASSERT_TRUE(found.has_value()) << i;
        const CoreOracle small(*pebble, atPebble), large(*rock, atRock);
        const DistanceOracle oracle(small.posed(), large.posed());
        const double exact = exactBoxDistance(small, large, oracle);
        const btVector3 normal = isSwapped ? -found->normal : found->normal;
        const LongVector n(normal.x(), normal.y(), normal.z());
        EXPECT_NEAR(found->distance, exact, tolerance) << i;
        // The gap along the normal, or the distance of the pebble from it along the normal.
        EXPECT_NEAR(-double(oracle.extent(-n)), exact, tolerance) << i;
        (exact > 0 ? apart : overlapping)++;
    }
    EXPECT_GT(apart, 600);
    EXPECT_GT(overlapping, 600);
    EXPECT_EQ(bench.registration->stats().notConvergedTotal, 0u);
}

TEST(IsaGjkQueries, GivePatchWithCornersOfOverlapOfTwoBricks)
{
    ConvexBench bench;
    auto upper = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    btBoxShape lower(vec(1, 0.5, 1));
    ConvexPairProbe probe(bench.dispatcher, *upper, lower);
    // Hanging over the edge of the box, whose core ends at 0.96; also before they touch, and when they overlap deeply.
    for (const double gap : {-0.2, -0.01, 0.0, 0.015})
    {
        probe.place(vec(0.8, 1.04 + gap, 0), vec(0, 0, 0));
        const std::vector<Reported> points = probe.query();
        ASSERT_EQ(points.size(), 4u) << gap;
        double low = 9, high = -9;
        for (const Reported& point : points)
        {
            EXPECT_NEAR(point.distance, gap, 1e-6);
            EXPECT_NEAR(std::abs(double(point.onB.z())), 0.5, 1e-6);
            low = std::min(low, double(point.onB.x()));
            high = std::max(high, double(point.onB.x()));
        }
        EXPECT_NEAR(low, 0.3, 1e-6);
        EXPECT_NEAR(high, 0.96, 1e-6);
    }
}

TEST(IsaGjkQueries, GiveNoPatchPointThatManifoldWouldMergeWithDeepest)
{
    ConvexBench bench;
    // On its edge, and thinner than the threshold within which Bullet's manifold merges points.
    auto plate = makeHullShape(boxPoints(0.5, 0.5, 0.004));
    btBoxShape ground(vec(5, 0.5, 5));
    const btScalar threshold = plate->getContactBreakingThreshold(gContactBreakingThreshold);
    ASSERT_GT(threshold, btScalar(0.008));
    ConvexPairProbe probe(bench.dispatcher, *plate, ground);
    for (const double turn : {0.0, 0.1, 1.0})
    {
        const btTransform upright(btQuaternion(btVector3(0, 1, 0), btScalar(turn)), vec(0, 1.045, 0));
        probe.place(upright, btTransform::getIdentity());
        const std::vector<Reported> points = probe.query();
        // All four corners are as deep; two are at the other end.
        ASSERT_EQ(points.size(), 3u) << turn;
        for (std::size_t i = 0; i < points.size(); ++i)
        {
            EXPECT_NEAR(points[i].distance, 0.005, 1e-5) << turn;
            EXPECT_TRUE(i == 0 || points[i].onB.distance(points[0].onB) > threshold) << turn;
        }
    }
}

TEST(IsaGjkQueries, GiveFourPatchPointsWhenCornersLieOnOneSideOfLongestLine)
{
    ConvexBench bench;
    std::vector<btVector3> points;
    for (const double y : {-0.2, 0.2})
    {
        points.push_back(vec(-1, y, 0));
        points.push_back(vec(1, y, 0));
        points.push_back(vec(0.8, y, 0.6));
        points.push_back(vec(0, y, 0.7));
        points.push_back(vec(-0.8, y, 0.6));
    }
    auto slab = makeHullShape(points);
    btBoxShape ground(vec(5, 0.5, 5));
    ConvexPairProbe probe(bench.dispatcher, *slab, ground);
    for (const double tilt : {0.002, -0.002})
    {
        probe.place(btTransform(btQuaternion(btVector3(0, 0, 1), btScalar(tilt)), vec(0, 0.745, 0)),
                    btTransform::getIdentity());
        const std::vector<Reported> patch = probe.query();
        ASSERT_EQ(patch.size(), 4u) << tilt;
        // The ends of the long side, the corner across, and one of its neighbours.
        std::vector<double> places;
        for (const Reported& point : patch)
            places.push_back(std::round(10 * std::abs(double(point.onB.x()))) / 10);
        std::sort(places.begin(), places.end());
        EXPECT_EQ(places, (std::vector<double>{0, 0.8, 1, 1})) << tilt;
    }
}

TEST(IsaGjkQueries, GiveDeepestPatchPointOfTiltedBrickAndNoneBeyondThreshold)
{
    ConvexBench bench;
    auto brick = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    btBoxShape ground(vec(5, 0.5, 5));
    ConvexPairProbe probe(bench.dispatcher, *brick, ground);
    int patches = 0;
    for (int i = 0; i <= 90; ++i)
    {
        const double angle = i * SIMD_PI / 180;
        const double reach = 0.5 * (std::cos(angle) + std::sin(angle));
        const double gap = 0.005;
        const btTransform tilted(btQuaternion(btVector3(0, 0, 1), btScalar(angle)),
                                 vec(0, 0.5 + 0.04 + reach + gap, 0));
        probe.place(tilted, btTransform::getIdentity());
        const std::vector<Reported> points = probe.query();
        ASSERT_GE(points.size(), 2u) << i;
        double least = 9;
        for (const Reported& point : points)
        {
            least = std::min(least, point.distance);
            EXPECT_LT(point.distance, 0.03) << i;
        }
        EXPECT_NEAR(least, gap, 1e-5) << i;
        patches += points.size() == 4;
    }
    EXPECT_GE(patches, 2);
    EXPECT_LT(patches, 10);
}
}  // namespace cullet::test
