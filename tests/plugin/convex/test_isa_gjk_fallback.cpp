// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/convex/convex_contacts.h"
#include "cullet/tests/plugin/convex/faulty_cube.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace cullet::test
{
TEST(IsaGjkFallback, CountsQueryThatMeetsNanAndLeavesItToBullet)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    const btTransform turned(btQuaternion(vec(1, 2, 3).normalized(), btScalar(0.3)), vec(0.1, 0, 0.05));
    int failed = 0, delegated = 0;
    for (const double height : {3.0, 1.09, 0.5})
    {
        for (int badCall = -1; badCall < 8; ++badCall)
        {
            SCOPED_TRACE(testing::Message() << "height " << height << ", call " << badCall);
            ConvexBench bench;
            FaultyCube faulty(badCall,
                              [] { return btVector3(std::numeric_limits<btScalar>::quiet_NaN(), 0, 0); });
            ConvexPairProbe probe(bench.dispatcher, faulty, *cube);
            btTransform above = turned;
            above.setOrigin(turned.getOrigin() + vec(0, height, 0));
            probe.place(above, btTransform::getIdentity());
            EXPECT_EQ(probe.query().empty(), height > 2);
            const IsaGjkStats stats = bench.registration->stats();
            EXPECT_EQ(stats.separatedTotal + stats.notConvergedTotal + stats.delegatedTotal, 1u);
            // The first axis needs a support of the faulty shape for every pair.
            EXPECT_TRUE(badCall != 0 || stats.notConvergedTotal == 1);
            failed += int(stats.notConvergedTotal);
            delegated += int(stats.delegatedTotal);
        }
    }
    EXPECT_GE(failed, 5);
    EXPECT_GE(delegated, 5);
}

TEST(IsaGjkFallback, CountsTouchingRoundShapesAsDelegatedAndNotAsUnconverged)
{
    constexpr unsigned kSeed = 18;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    std::uniform_real_distribution<double> place(-0.4, 0.4), gap(-0.05, 0.02);
    btCylinderShapeZ cylinder(vec(0.25, 0.25, 0.25));
    btConeShapeZ cone(btScalar(0.25), btScalar(0.5));
    btBoxShape box(vec(0.25, 0.25, 0.25)), floor(vec(25, 25, 0.5));
    btSphereShape ball(btScalar(0.25));
    btConvexShape* const shapes[] = {&cylinder, &cone, &box, &ball};
    for (btConvexShape* lower : {static_cast<btConvexShape*>(&floor), shapes[0], shapes[1]})
    {
        for (btConvexShape* upper : shapes)
        {
            ConvexBench bench;
            ConvexPairProbe probe(bench.dispatcher, *upper, *lower);
            const bool isFloor = lower == &floor;
            if (isFloor && upper != shapes[0] && upper != shapes[1])
                continue;
            for (int i = 0; i < 200; ++i)
            {
                const double height = (isFloor ? 0.75 : 0.5) + gap(engine);
                const double aside = isFloor ? 1.0 : 0.3;
                const double y = aside * place(engine), x = aside * place(engine);
                probe.place(vec(x, y, i % 7 < 2 ? 3 : height), vec(0, 0, 0));
                probe.step();
            }
            const IsaGjkStats stats = bench.registration->stats();
            EXPECT_EQ(stats.notConvergedTotal, 0u) << upper->getName() << " on " << lower->getName();
            EXPECT_EQ(stats.touchingTotal, 0u) << upper->getName() << " on " << lower->getName();
            EXPECT_GT(stats.separatedTotal, 20u) << upper->getName() << " on " << lower->getName();
            EXPECT_GT(stats.delegatedTotal, 100u) << upper->getName() << " on " << lower->getName();
        }
    }
}

namespace
{
/// Two overlapping bodies with numbers at the limits of btScalar.
struct Extreme
{
    double size;   ///< of the points
    double scale;  ///< of both shapes
    double shift;  ///< between the bodies, of size * scale
};

/// @param isCounted the shapes have points, with any scale and position
/// @return the statistics of the queries
IsaGjkStats checkExtreme(const Extreme& extreme, bool isRound, bool isCounted)
{
    constexpr std::uint64_t kFrames = 3;
    ConvexBench bench;
    const auto shape = makeHullShape(isRound ? ballPoints(50, 0.5, 3) : boxPoints(0.5, 0.5, 0.5));
    for (int i = 0; i < shape->getNumPoints(); ++i)
        shape->getUnscaledPoints()[i] *= btScalar(extreme.size);
    shape->setLocalScaling(vec(extreme.scale, extreme.scale, extreme.scale));
    ConvexPairProbe probe(bench.dispatcher, *shape, *shape);
    const btScalar shift = btScalar(extreme.shift) * btScalar(extreme.size) * btScalar(extreme.scale);
    probe.place(btTransform(btQuaternion(vec(1, 2, 3).normalized(), btScalar(0.3)),
                            btVector3(shift, shift / 2, shift / 3)),
                btTransform::getIdentity());
    std::uint64_t touching = 0;
    for (std::uint64_t frame = 0; frame < kFrames; ++frame)
    {
        const std::vector<Reported> points = probe.query();
        // Otherwise the contacts are Bullet's.
        const bool areOurs = bench.registration->stats().touchingTotal > touching;
        touching = bench.registration->stats().touchingTotal;
        for (std::size_t i = 0; i < points.size() && areOurs; ++i)
        {
            EXPECT_TRUE(std::isfinite(points[i].distance));
            EXPECT_NEAR(double(points[i].normal.length()), 1.0, 1e-4);
            for (int axis = 0; axis < 3; ++axis)
                EXPECT_TRUE(std::isfinite(points[i].onB[axis]));
        }
    }
    const IsaGjkStats stats = bench.registration->stats();
    EXPECT_EQ(stats.separatedTotal + stats.touchingTotal + stats.notConvergedTotal, isCounted ? kFrames : 0);
    return stats;
}
}  // namespace

TEST(IsaGjkFallback, GivesFiniteContactsOrCountsFailureForExtremeNumbers)
{
    constexpr double kMost = double(std::numeric_limits<btScalar>::max());
    constexpr double kLeast = double(std::numeric_limits<btScalar>::denorm_min());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    std::uint64_t touching = 0, failed = 0;
    for (const double size : {0.99 * kMost, 0.3 * kMost, std::sqrt(kMost), std::cbrt(kMost), 1e12, 1.0, 1e-12,
                              1 / std::sqrt(kMost), 1 / kMost, 8 * kLeast, kLeast})
    {
        for (const double scale : {1.0, 0.5 * kMost, 1e18, 1e-18, kLeast, 0.0, -1.0, nan, HUGE_VAL})
        {
            for (const double shift : {0.0, 0.1, 0.9})
            {
                for (const bool isRound : {false, true})
                {
                    SCOPED_TRACE(testing::Message() << "size " << size << ", scale " << scale << ", shift "
                                                    << shift << (isRound ? ", round" : ""));
                    // A body at a non-finite position has no contacts.
                    const bool isPlaced =
                        std::isfinite(double(btScalar(shift) * btScalar(size) * btScalar(scale)));
                    const IsaGjkStats stats = checkExtreme({size, scale, shift}, isRound, isPlaced);
                    touching += stats.touchingTotal;
                    failed += stats.notConvergedTotal;
                }
            }
        }
    }
    EXPECT_GT(touching, 100u);
    EXPECT_GT(failed, 30u);
}

TEST(IsaGjkFallback, CountsEveryTestOfPairThatItLeavesToBullet)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    btCylinderShape insideOut(vec(0.5, 0.5, 0.5));
    insideOut.setMargin(1);
    btCapsuleShape capsule(btScalar(0.25), btScalar(0.5));
    ConvexBench bench;
    std::uint64_t tests = 0;
    const auto expectCounted = [&](btCollisionShape& upper, btCollisionShape& lower)
    {
        ConvexPairProbe probe(bench.dispatcher, *cube, *cube);
        probe.bodyA.setCollisionShape(&upper);
        probe.bodyB.setCollisionShape(&lower);
        for (const double x : {0.3, 0.45, 3.0})
        {
            probe.place(vec(x, 0, 0), vec(0, 0, 0));
            probe.step();
            EXPECT_EQ(bench.registration->stats().delegatedTotal, ++tests) << upper.getName() << " at " << x;
        }
    };
    expectCounted(insideOut, *cube);
    expectCounted(capsule, capsule);
    EXPECT_EQ(bench.registration->stats().separatedTotal, 0u);
}
}  // namespace cullet::test
