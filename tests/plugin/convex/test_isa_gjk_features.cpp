// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/convex/convex_contacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <random>

namespace cullet::test
{
namespace
{
/// Distance of the deepest point of a new pair; infinity without a point.
double deepestOf(btCollisionDispatcher& dispatcher, btCollisionShape& a, const btTransform& at,
                 btCollisionShape& b, const btTransform& bt)
{
    ConvexPairProbe probe(dispatcher, a, b);
    probe.place(at, bt);
    const btPersistentManifold* manifold = probe.step();
    double deepest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < manifold->getNumContacts(); ++i)
        deepest = std::min(deepest, double(manifold->getContactPoint(i).getDistance()));
    return deepest;
}
}  // namespace

TEST(IsaGjkFeatures, RemoveMarginsFromContactDistances)
{
    auto upper = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    auto lower = makeHullShape(boxPoints(2, 0.5, 2));
    ConvexBench bench;
    ConvexPairProbe probe(bench.dispatcher, *upper, *lower);
    probe.place(vec(0, 0.99, 0), vec(0, 0, 0));
    std::vector<Reported> points = probe.query();
    ASSERT_EQ(points.size(), 4u);
    EXPECT_NEAR(points[0].distance, -0.01 - 0.08, 1e-6);
    upper->initializePolyhedralFeatures();
    lower->initializePolyhedralFeatures();
    points = probe.query();
    ASSERT_EQ(points.size(), 4u);
    for (const Reported& point : points)
        EXPECT_NEAR(point.distance, -0.01, 1e-6);

    // Bullet's separating axis test, if the application enables it.
    btDispatcherInfo info;
    info.m_enableSatConvex = true;
    const std::uint64_t before = bench.registration->stats().delegatedTotal;
    points = probe.query(0, info);
    EXPECT_EQ(bench.registration->stats().delegatedTotal, before + 1);
    ASSERT_GE(points.size(), 4u);
    EXPECT_NEAR(points[0].distance, -0.01, 1e-3);
}

TEST(IsaGjkFeatures, GiveDeepestDistanceOfBulletsClipping)
{
    constexpr unsigned kSeed = 67;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5)), slab = makeHullShape(boxPoints(2, 0.5, 2)),
         wedge = makeHullShape(boxPoints(0.5, 0.4, 0.3));
    wedge->addPoint(vec(0, 0.8, 0));
    for (const auto& shape : {cube.get(), slab.get(), wedge.get()})
        shape->initializePolyhedralFeatures();
    ConvexBench bench, stock(true);
    std::map<bool, int> contacts;
    std::uniform_real_distribution<double> angle(-0.05, 0.05), gap(-0.03, 0.05);
    for (int i = 0; i < 400; ++i)
    {
        SCOPED_TRACE(i);
        btCollisionShape& upper = i % 2 == 0 ? *cube : *wedge;
        const double height = 0.5 + (i % 2 == 0 ? 0.5 : 0.4) + gap(engine);
        const auto pitch = btScalar(i % 3 == 0 ? angle(engine) : 0), yaw = btScalar(angle(engine));
        const btTransform at(btQuaternion(yaw, pitch, 0), vec(0.2, height, 0.1));
        const btTransform bt = btTransform::getIdentity();
        const double ours = deepestOf(bench.dispatcher, upper, at, *slab, bt);
        const double bullets = deepestOf(stock.dispatcher, upper, at, *slab, bt);
        // Skips cases in which rounding decides whether a point is within the breaking threshold.
        if (std::min(ours, bullets) > 0.0199)
            continue;
        EXPECT_NEAR(ours, bullets, 1e-3);
        ++contacts[bullets < 0];
    }
    EXPECT_GT(contacts[false], 50);
    EXPECT_GT(contacts[true], 50);
}
}  // namespace cullet::test
