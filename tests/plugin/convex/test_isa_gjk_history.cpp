// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/convex/convex_contacts.h"

#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

/// A query gives the same bits for any history of its pair.
namespace cullet::test
{
namespace
{
/// Named shapes with polytope cores, of a size of about 1.
struct NamedShape
{
    std::string name;
    std::unique_ptr<btCollisionShape> shape;
};

std::unique_ptr<btConvexHullShape> roundHull(int count, unsigned seed)
{
    return makeHullShape(ballPoints(count, 0.5, seed));
}

std::vector<NamedShape> historyShapes()
{
    std::vector<NamedShape> shapes;
    shapes.push_back({"cube", makeHullShape(boxPoints(0.5, 0.5, 0.5))});
    shapes.push_back({"hull24", roundHull(24, 3)});
    shapes.push_back({"hull100", roundHull(100, 4)});
    auto bare = makeHullShape(boxPoints(0.5, 0.4, 0.3));
    bare->setMargin(0);
    shapes.push_back({"bare brick", std::move(bare)});
    auto scaled = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    scaled->setLocalScaling(vec(1.5, 0.4, 0.8));
    shapes.push_back({"scaled", std::move(scaled)});
    shapes.push_back({"box", std::make_unique<btBoxShape>(vec(0.5, 0.4, 0.6))});
    shapes.push_back({"floor", std::make_unique<btBoxShape>(vec(20, 0.5, 20))});
    shapes.push_back({"capsule", std::make_unique<btCapsuleShape>(btScalar(0.2), btScalar(0.8))});
    shapes.push_back(
        {"triangle", std::make_unique<btTriangleShape>(vec(-1, 0, -1), vec(1, 0, -1), vec(0, 0, 1))});
    shapes.push_back({"cylinder", std::make_unique<btCylinderShape>(vec(0.4, 0.5, 0.4))});
    return shapes;
}

using Random = std::mt19937;

double uniform(Random& random)
{
    return std::uniform_real_distribution<double>(-1, 1)(random);
}

/// From z to x, as drawVec(); so below.
btVector3 uniformVec(Random& random)
{
    const double z = uniform(random), y = uniform(random), x = uniform(random);
    return vec(x, y, z);
}

btQuaternion turn(Random& random, double angle)
{
    const double z = uniform(random) + 0.01, y = uniform(random), x = uniform(random);
    const btVector3 axis = vec(x, y, z);
    return btQuaternion(axis.normalized(), btScalar(angle * uniform(random)));
}

/// Poses of B, each near the previous one: randomly rotated, nearly level, or level; A is at the origin.
struct Poses
{
    enum class Kind
    {
        Any,
        Nearly,
        Level
    };

    Poses(Random& random, double height, Kind kind)
    {
        const bool isAny = kind == Kind::Any;
        const auto above = [&]
        {
            const double z = 0.3 * uniform(random), x = 0.3 * uniform(random);
            return vec(x, height, z);
        };
        const btVector3 origin = isAny ? uniformVec(random).normalized() * btScalar(height) : above();
        btTransform pose(isAny ? turn(random, 3) : btQuaternion::getIdentity(), origin);
        for (int i = 0; i < 6; ++i)
        {
            before.push_back(pose);
            const double away = i % 2 == 0 ? 0.03 : 0.0005;
            pose.setOrigin(pose.getOrigin() + uniformVec(random) * btScalar(away));
            if (kind != Kind::Level)
                pose.setRotation((turn(random, isAny ? 0.1 : 1e-3) * pose.getRotation()).normalized());
        }
        asked = pose;
    }

    std::vector<btTransform> before;
    btTransform asked;
};

std::vector<double> numbersOf(const btPersistentManifold* manifold)
{
    std::vector<double> numbers;
    for (int i = 0; manifold != nullptr && i < manifold->getNumContacts(); ++i)
    {
        const btManifoldPoint& point = manifold->getContactPoint(i);
        for (int k = 0; k < 3; ++k)
        {
            numbers.push_back(double(point.m_positionWorldOnB[k]));
            numbers.push_back(double(point.m_normalWorldOnB[k]));
            numbers.push_back(double(point.m_localPointA[k]));
        }
        numbers.push_back(double(point.getDistance()));
    }
    return numbers;
}

/// Contacts of a step at a pose, from an empty manifold.
std::vector<double> stepAt(ConvexPairProbe& probe, const btTransform& at)
{
    probe.place(btTransform::getIdentity(), at);
    btManifoldArray manifolds;
    probe.algorithm->getAllContactManifolds(manifolds);
    for (int i = 0; i < manifolds.size(); ++i)
        manifolds[i]->clearManifold();
    return numbersOf(probe.step());
}

std::vector<double> numbersOf(const std::vector<Reported>& points)
{
    std::vector<double> numbers;
    for (const Reported& point : points)
    {
        for (int k = 0; k < 3; ++k)
        {
            numbers.push_back(double(point.normal[k]));
            numbers.push_back(double(point.onB[k]));
        }
        numbers.push_back(point.distance);
    }
    return numbers;
}

std::vector<double> queryAt(ConvexPairProbe& probe, const btTransform& at, double threshold)
{
    probe.place(btTransform::getIdentity(), at);
    return numbersOf(probe.query(threshold));
}

class IsaGjkHistory : public testing::TestWithParam<Poses::Kind>
{
};

/// Tests every pair of shapes, from deep to just within the threshold.
TEST_P(IsaGjkHistory, ChangesNoBitOfQueryOrStep)
{
    constexpr unsigned kSeed = 20261125;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    IsaGjkOptions options;
    options.boxPairs = BoxPairs::IsaGjk;
    ConvexBench bench(false, options);
    const std::vector<NamedShape> shapes = historyShapes();
    int touching = 0, several = 0;
    for (const NamedShape& a : shapes)
    {
        for (const NamedShape& b : shapes)
        {
            for (int i = 0; i < 60; ++i)
            {
                const double height =
                    (a.name == "floor" || b.name == "floor" ? 1.0 : 0.9) + 0.15 * uniform(random);
                const Poses poses(random, height, GetParam());
                for (const auto table : {BT_CONTACT_POINT_ALGORITHMS, BT_CLOSEST_POINT_ALGORITHMS})
                {
                    const double threshold = table == BT_CLOSEST_POINT_ALGORITHMS ? 0.2 : 0.0;
                    ConvexPairProbe used(bench.dispatcher, *a.shape, *b.shape, table);
                    ConvexPairProbe fresh(bench.dispatcher, *a.shape, *b.shape, table);
                    for (const btTransform& pose : poses.before)
                        queryAt(used, pose, threshold);
                    const std::vector<double> expected = queryAt(fresh, poses.asked, threshold);
                    ASSERT_EQ(queryAt(used, poses.asked, threshold), expected)
                        << a.name << " " << b.name << " " << i;
                    const std::vector<double> expectedStep = stepAt(fresh, poses.asked);
                    ASSERT_EQ(stepAt(used, poses.asked), expectedStep) << a.name << " " << b.name << " " << i;
                    touching += expected.empty() ? 0 : 1;
                    several += expected.size() > 7 ? 1 : 0;
                }
            }
        }
    }
    EXPECT_GT(touching, 2500);
    EXPECT_GT(several, GetParam() == Poses::Kind::Any ? 200 : 450);
    EXPECT_GT(bench.registration->stats().depthsTotal, 500u);
}

/// Where faces are tilted by less than an expansion tells apart, two normals have nearly the same depth.
TEST(IsaGjkDepths, DependOnNoEarlierPoseWhenFacesAreNearlyLevel)
{
    constexpr unsigned kSeed = 11;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    IsaGjkOptions options;
    options.boxPairs = BoxPairs::IsaGjk;
    ConvexBench bench(false, options);
    btBoxShape box(vec(1, 1, 1));
    for (int i = 0; i < 1500; ++i)
    {
        const double tilt = std::exp2(-24 + 8 * uniform(random));
        ConvexPairProbe used(bench.dispatcher, box, box), fresh(bench.dispatcher, box, box);
        btTransform pose;
        for (int frame = 0; frame < 4; ++frame)
        {
            const double x = uniform(random), y = uniform(random), deep = 0.15 + 0.05 * uniform(random);
            pose = btTransform(turn(random, tilt), vec(x, y, 2 - deep));
            queryAt(used, pose, 0);
        }
        ASSERT_EQ(queryAt(used, pose, 0), queryAt(fresh, pose, 0)) << i << ", tilt " << tilt;
    }
    EXPECT_EQ(bench.registration->stats().depthsTotal, 1500u * 6);
}

/// A vector of multiples of a quarter, up to 1.
btVector3 latticeVec(Random& random)
{
    const auto quarter = [&] { return 0.25 * std::round(4 * uniform(random)); };
    const double z = quarter(), y = quarter(), x = quarter();
    return vec(x, y, z);
}

/// Shapes of a size of about 1 with level faces: boxes, capsules, triangles, without area too, and cubes with a roof that
/// is nearly flat.
std::unique_ptr<btConvexShape> levelShape(Random& random, int kind)
{
    if (kind == 0)
        return std::make_unique<btBoxShape>(latticeVec(random).absolute() + vec(0.25, 0.25, 0.25));
    if (kind == 1)
        return std::make_unique<btCapsuleShape>(btScalar(0.25), btScalar(1));
    if (kind == 2)
    {
        const btVector3 a = latticeVec(random), b = latticeVec(random), c = latticeVec(random);
        return std::make_unique<btTriangleShape>(a, b, c);
    }
    std::vector<btVector3> points = boxPoints(1, 1, 1);
    const double lowest = sizeof(btScalar) == sizeof(float) ? -24 : -50;
    const double high = std::exp2(lowest * std::abs(uniform(random)) - 4);
    const double z = uniform(random), x = kind == 3 ? 1 : uniform(random);
    points.push_back(vec(x, 1 + high, z));
    points.push_back(vec(x, -1 - high, z));
    return makeHullShape(points);
}

/// Over features that are level but for a tilt of any size, rounding leaves several pairs of features equally close or
/// equally deep.
TEST(IsaGjkNearlyLevelFeatures, GiveSameContactsForAnyHistory)
{
    constexpr unsigned kSeed = 15;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    IsaGjkOptions options;
    options.boxPairs = BoxPairs::IsaGjk;
    ConvexBench bench(false, options);
    int touching = 0;
    for (int i = 0; i < 4000; ++i)
    {
        const auto a = levelShape(random, i % 5), b = levelShape(random, i / 5 % 5);
        const btQuaternion turned = i % 2 == 0 ? btQuaternion::getIdentity() : turn(random, 3);
        ConvexPairProbe used(bench.dispatcher, *a, *b);
        for (int frame = 0; frame < 8; ++frame)
        {
            const double tilt = std::exp2(-24 + 24 * uniform(random));
            const btVector3 place = latticeVec(random), beside = uniformVec(random) * btScalar(0.1);
            const double height = 1.7 + uniform(random);
            const btTransform at(turned * (frame % 4 == 0 ? btQuaternion::getIdentity() : turn(random, tilt)),
                                 quatRotate(turned, vec(place.x(), height, place.z()) +
                                                        (frame % 2 == 0 ? beside : vec(0, 0, 0))));
            const btTransform from(turned, vec(0, 0, 0));
            ConvexPairProbe fresh(bench.dispatcher, *a, *b);
            fresh.place(from, at);
            used.place(from, at);
            const std::vector<double> expected = numbersOf(fresh.query(1));
            ASSERT_EQ(numbersOf(used.query(1)), expected) << i << ", frame " << frame << ", tilt " << tilt;
            touching += expected.empty() ? 0 : 1;
        }
    }
    EXPECT_GT(touching, 10000);
    EXPECT_GT(bench.registration->stats().depthsTotal, 4000u);
}

std::string nameOf(const testing::TestParamInfo<Poses::Kind>& info)
{
    const char* const names[] = {"Any", "Nearly", "Level"};
    return names[static_cast<int>(info.param)];
}

INSTANTIATE_TEST_SUITE_P(Poses, IsaGjkHistory,
                         testing::Values(Poses::Kind::Any, Poses::Kind::Nearly, Poses::Kind::Level), nameOf);

/// Hulls with vertices whose ids do not fit into a cache, without a graph.
TEST(IsaGjkLargeHulls, GiveSameContactsForAnyHistory)
{
    constexpr unsigned kSeed = 7;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    ConvexBench bench;
    const auto hull = roundHull(70000, kSeed);
    btBoxShape box(vec(1, 0.5, 1));
    int touching = 0;
    for (int i = 0; i < 60; ++i)
    {
        ConvexPairProbe used(bench.dispatcher, *hull, box), fresh(bench.dispatcher, *hull, box);
        const Poses poses(random, 1.0 + 0.08 * uniform(random), Poses::Kind::Any);
        for (const btTransform& pose : poses.before)
            queryAt(used, pose, 0.0);
        const std::vector<double> expected = stepAt(fresh, poses.asked);
        ASSERT_EQ(stepAt(used, poses.asked), expected) << i;
        touching += expected.empty() ? 0 : 1;
    }
    EXPECT_GT(touching, 20);
    EXPECT_GT(bench.registration->stats().depthsTotal, 100u);
}

/// The distance compared with the threshold is the final one, not the differently rounded one of a search.
TEST(IsaGjkThreshold, GivesSameContactsWhateverWasQueriedBefore)
{
    Random random(5);
    ConvexBench bench;
    const auto hull = roundHull(24, 3);
    int touching = 0;
    for (int i = 0; i < 200; ++i)
    {
        const btVector3 direction = uniformVec(random).normalized();
        const btQuaternion turned = turn(random, 3);
        ConvexPairProbe fresh(bench.dispatcher, *hull, *hull, BT_CLOSEST_POINT_ALGORITHMS);
        const btTransform far(turned, direction * btScalar(1.5));
        const std::vector<double> closest = queryAt(fresh, far, 10);
        ASSERT_EQ(closest.size(), 7u);
        // One rounding decides.
        for (const double threshold :
             {closest[6], std::nextafter(closest[6], 0.0), std::nextafter(closest[6], 2.0)})
        {
            ConvexPairProbe used(bench.dispatcher, *hull, *hull, BT_CLOSEST_POINT_ALGORITHMS);
            ConvexPairProbe other(bench.dispatcher, *hull, *hull, BT_CLOSEST_POINT_ALGORITHMS);
            queryAt(used, btTransform(turned, direction * btScalar(1.49)), threshold);
            queryAt(used, btTransform(turned, direction * btScalar(1.6)), threshold);
            const std::vector<double> expected = queryAt(other, far, threshold);
            ASSERT_EQ(queryAt(used, far, threshold), expected) << i;
            touching += expected.empty() ? 0 : 1;
        }
    }
    EXPECT_GT(touching, 100);
}

/// Corners of one face that rounding has moved off its plane: several triangles of them are nearly the closest.
TEST(IsaGjkDistances, DependOnNoEarlierPoseOverFaceThatRoundingBends)
{
    constexpr unsigned kSeed = 12;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    ConvexBench bench;
    const auto pin = makeHullShape({vec(0, 0, 0)});
    for (int i = 0; i < 1500; ++i)
    {
        std::vector<btVector3> points;
        const btQuaternion tilt = turn(random, 1);
        for (int corner = 0; corner < 9; ++corner)
            points.push_back(quatRotate(tilt, vec(std::cos(0.7 * corner), 0, std::sin(0.7 * corner))));
        // Flat, or the base of a pyramid.
        if (i % 2 == 0)
            points.push_back(quatRotate(tilt, vec(0, -1, 0)));
        const auto plate = makeHullShape(points);
        ConvexPairProbe used(bench.dispatcher, *pin, *plate, BT_CLOSEST_POINT_ALGORITHMS);
        ConvexPairProbe fresh(bench.dispatcher, *pin, *plate, BT_CLOSEST_POINT_ALGORITHMS);
        btTransform pose(btQuaternion::getIdentity(), btVector3(0, 0, 0));
        for (int frame = 0; frame < 5; ++frame)
        {
            const double x = 0.6 * uniform(random), z = 0.6 * uniform(random);
            pose.setOrigin(-quatRotate(tilt, vec(x, 0.5, z)));
            queryAt(used, pose, 1);
        }
        ASSERT_EQ(queryAt(used, pose, 1), queryAt(fresh, pose, 1)) << i;
    }
    EXPECT_EQ(bench.registration->stats().touchingTotal, 1500u * 7);
}

/// A tilt of some roundings decides which features are the closest, for a capsule of any size.
TEST(IsaGjkDistances, ScaleWithNearlyLevelCapsules)
{
    constexpr unsigned kSeed = 14;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    ConvexBench bench;
    btBoxShape box(vec(1, 1, 1)), large(vec(8, 8, 8));
    large.setMargin(8 * box.getMargin());
    btCapsuleShapeX capsule(btScalar(0.25), 1), longer(2, 8);
    for (int i = 0; i < 500; ++i)
    {
        const double tilt = std::ldexp(1 + std::abs(uniform(random)), -27 - i % 10);
        const double z = 0.25 * uniform(random), x = 0.25 * uniform(random);
        btTransform at(btMatrix3x3(1, btScalar(-tilt), 0, btScalar(tilt), 1, 0, 0, 0, 1), vec(x, -1.5, z));
        ConvexPairProbe pair(bench.dispatcher, capsule, box, BT_CLOSEST_POINT_ALGORITHMS);
        ConvexPairProbe scaled(bench.dispatcher, longer, large, BT_CLOSEST_POINT_ALGORITHMS);
        pair.bodyB.setWorldTransform(at);
        at.setOrigin(at.getOrigin() * 8);
        scaled.bodyB.setWorldTransform(at);
        const std::vector<Reported> expected = pair.query(1), found = scaled.query(8);
        ASSERT_EQ(expected.size(), 1u);
        ASSERT_EQ(found.size(), 1u);
        EXPECT_EQ(found[0].normal, expected[0].normal) << tilt;
        EXPECT_EQ(found[0].onB, expected[0].onB * 8) << tilt;
        EXPECT_EQ(found[0].distance, expected[0].distance * 8) << tilt;
    }
}

/// Points whose hull has clear faces, faces that are level up to rounding, or no faces.
std::vector<btVector3> anyPoints(Random& random, int kind)
{
    const int counts[] = {4, 6, 8, 12, 24, 60, 150};
    const int count = counts[static_cast<std::size_t>(kind) % 7];
    std::vector<btVector3> points = ballPoints(count, 0.5, random());
    for (btVector3& p : points)
    {
        switch (kind / 7)
        {
            case 0:
                break;
            case 1:
                p *= btScalar(1 - 0.1 * std::abs(uniform(random)));
                break;
            case 2:
                p = vec(p.x(), 0.02 * p.y(), 0.4 * p.z());
                break;
            case 3:
                p = vec(std::round(6 * p.x()), std::round(6 * p.y()), std::round(6 * p.z())) * btScalar(0.1);
                break;
            // Heights on both sides of the tolerance of merging.
            default:
                p.setY(btScalar(std::copysign(0.4, p.y()) + 3e-6 * uniform(random)));
        }
    }
    return points;
}

/// Compares the contacts of a hull before and after its graph is built.
class ContactsOfNewHulls
{
public:
    explicit ContactsOfNewHulls(const std::vector<btVector3>& hull)
        : m_points(hull), m_unknown(makeHullShape(hull))
    {
    }

    /// Expects equal bits from both
    void compare(btCollisionShape& other, const btTransform& at, const std::string& name)
    {
        const std::uint64_t before = hullCacheStats().buildsTotal;
        const Answer expected = answer(*m_unknown, other, at);
        builds += static_cast<int>(hullCacheStats().buildsTotal - before);
        const auto known = makeHullShape(m_points);
        prepare(*known);
        const Answer found = answer(*known, other, at);
        invalidate(*known);
        ASSERT_EQ(found.queried, expected.queried) << name;
        ASSERT_EQ(found.stepped, expected.stepped) << name;
        points = static_cast<int>(expected.stepped.size() / 10);
    }

    int builds = 0;
    int points = 0;  ///< of the last contact

private:
    struct Answer
    {
        std::vector<double> queried, stepped;
    };

    Answer answer(btCollisionShape& shape, btCollisionShape& other, const btTransform& at)
    {
        ConvexPairProbe probe(m_bench.dispatcher, other, shape);
        return {queryAt(probe, at, 0), stepAt(probe, at)};
    }

    std::vector<btVector3> m_points;
    std::unique_ptr<btConvexHullShape> m_unknown;
    ConvexBench m_bench;
};

/// Of points drawn anew in every step, the features that were deepest in the last step say nothing.
TEST(IsaGjkGraphs, AreSeldomBuiltForDeepHullsWhosePointsAreDrawnAnew)
{
    constexpr int kPoints = 100, kSteps = 400;
    const auto hull = makeHullShape(ballPoints(kPoints, 0.5, 1));
    btBoxShape ground(vec(5, 0.5, 5));
    ConvexBench bench;
    ConvexPairProbe probe(bench.dispatcher, *hull, ground);
    const std::uint64_t before = hullCacheStats().buildsTotal;
    for (unsigned step = 0; step < kSteps; ++step)
    {
        const std::vector<btVector3> points = ballPoints(kPoints, 0.5, 100 + step);
        std::copy(points.begin(), points.end(), hull->getUnscaledPoints());
        probe.place(vec(0, 0.85, 0), vec(0, 0, 0));
        EXPECT_GE(probe.step()->getNumContacts(), 1);
    }
    EXPECT_GT(bench.registration->stats().depthsTotal, kSteps * 9u / 10);
    EXPECT_LE(hullCacheStats().buildsTotal - before, 8u);
}

TEST(IsaGjkGraphs, ChangeNoBitOfContacts)
{
    constexpr unsigned kSeed = 7;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    btBoxShape floor(vec(20, 0.5, 20));
    btTriangleShape triangle(vec(-1, 0, -1), vec(1, 0, -1), vec(0, 0, 1));
    int withoutGraph = 0, withGraph = 0, several = 0;
    for (int i = 0; i < 35 * 180; ++i)
    {
        const std::vector<btVector3> points = anyPoints(random, i % 35);
        const auto partner = makeHullShape(ballPoints(24, 0.5, random()));
        partner->setLocalScaling(vec(1.5, 1, 0.7));
        btCollisionShape* const others[] = {&floor, partner.get(), &triangle};
        btCollisionShape& other = *others[i / 35 % 3];
        btScalar radius;
        btVector3 centre;
        btTransform at(i % 2 == 0 ? turn(random, 3) : turn(random, 0.01), btVector3(0, 0, 0));
        btVector3 low, high;
        makeHullShape(points)->getAabb(at, low, high);
        partner->getBoundingSphere(centre, radius);
        const double top = &other == &floor ? 0.5 : &other == &triangle ? 0.0 : double(radius) * 0.7;
        const double z = 0.1 * uniform(random), y = top - double(low.y()) + 0.05 * uniform(random);
        at.setOrigin(vec(0.1 * uniform(random), y, z));
        ContactsOfNewHulls contacts(points);
        contacts.compare(other, at, std::to_string(i));
        ASSERT_FALSE(HasFatalFailure());
        withoutGraph += contacts.points > 0 && contacts.builds == 0 ? 1 : 0;
        withGraph += contacts.points > 0 && contacts.builds > 0 ? 1 : 0;
        several += contacts.points > 1 && contacts.builds == 0 ? 1 : 0;
    }
    EXPECT_GT(withoutGraph, 500);
    EXPECT_GT(withGraph, 80);
    EXPECT_GT(several, 100);
}

/// A hull of three points is a flat one with a graph, and a cloud of points before.
TEST(IsaGjkGraphs, ChangeNoBitOfDistancesToTriangles)
{
    constexpr unsigned kSeed = 13;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    ConvexBench bench;
    const auto pin = makeHullShape({vec(0, 0, 0)});
    int over = 0;
    for (int i = 0; i < 500; ++i)
    {
        const std::vector<btVector3> points = {uniformVec(random), uniformVec(random), uniformVec(random)};
        const btVector3 middle = (points[0] + points[1] + points[2]) / 3;
        const btVector3 normal = (points[1] - points[0]).cross(points[2] - points[0]).normalized();
        const btTransform at(turn(random, 3));
        const btTransform pose =
            at * btTransform(btQuaternion::getIdentity(), -middle - normal * btScalar(0.5));
        const auto known = makeHullShape(points), unknown = makeHullShape(points);
        ConvexPairProbe before(bench.dispatcher, *pin, *unknown, BT_CLOSEST_POINT_ALGORITHMS);
        const std::vector<double> expected = queryAt(before, pose, 1);
        prepare(*known);
        ConvexPairProbe after(bench.dispatcher, *pin, *known, BT_CLOSEST_POINT_ALGORITHMS);
        ASSERT_EQ(queryAt(after, pose, 1), expected) << i;
        invalidate(*known);
        over += expected.empty() ? 0 : 1;
    }
    EXPECT_EQ(over, 500);
}
}  // namespace
}  // namespace cullet::test
