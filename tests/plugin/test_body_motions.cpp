// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "plugin/body_motions.h"
#include "tests/plugin/random_motion.h"

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace cullet::test
{
namespace
{
using Wide = long double;

Wide difference(const btTransform& a, const btTransform& b, const btVector3& p, int axis)
{
    Wide d = Wide(a.getOrigin()[axis]) - Wide(b.getOrigin()[axis]);
    for (int k = 0; k < 3; ++k)
        d += (Wide(a.getBasis()[axis][k]) - Wide(b.getBasis()[axis][k])) * Wide(p[k]);
    return d;
}

Wide distance(const btTransform& a, const btTransform& b, const btVector3& p)
{
    Wide sum = 0;
    for (int axis = 0; axis < 3; ++axis)
        sum += difference(a, b, p, axis) * difference(a, b, p, axis);
    return std::sqrt(sum);
}

/// A body beside one that is at rest unless it is told to move, looked at in a pass of its own each time.
class Watched
{
public:
    explicit Watched(btCollisionShape& shape)
    {
        body.setCollisionShape(&shape);
        body.setWorldTransform(btTransform::getIdentity());
        anchor.setCollisionShape(&shape);
        anchor.setWorldTransform(btTransform::getIdentity());
        m_place = m_motions.acquire(body);
        m_anchor = m_motions.acquire(anchor);
        update();
    }
    ~Watched()
    {
        m_motions.release(m_place);
        m_motions.release(m_anchor);
    }

    float update(bool isGap = false)
    {
        m_motions.use(m_place);
        m_motions.use(m_anchor);
        m_motions.update(0, m_motions.size(), ++s_pass, isGap);
        return m_motions.between(m_place, m_anchor);
    }
    /// So that the place is known.
    void rest()
    {
        update();
        EXPECT_EQ(update(), 0.0f);
    }
    float updateUnused()
    {
        m_motions.update(0, m_motions.size(), ++s_pass, false);
        return m_motions.between(m_place, m_anchor);
    }

    btCollisionObject body, anchor;

private:
    static inline std::uint64_t s_pass = std::uint64_t(1) << 40;
    BodyMotions m_motions;
    std::uint32_t m_place, m_anchor;
};
}  // namespace

TEST(BodyMotions, BoundTheMotionOfEveryPointOfTheCore)
{
    std::mt19937 engine(21);
    const auto ball = makeHullShape(ballPoints(30, 0.7, 3));
    ball->setLocalScaling(vec(1, -2, 0.25));
    Watched watched(*ball);
    int tight = 0, turned = 0;
    for (int i = 0; i < 3000; ++i)
    {
        const double size = std::pow(10.0, random(engine, -6, 0.5));
        const double far = i % 3 == 0 ? 1e4 : 1.0;
        btTransform from(randomRotation(engine), vec(far, -far, random(engine, -far, far)));
        btTransform to = moved(from, size, i % 2 == 0 ? 0 : random(engine, 0, 10), size * (i % 5), engine);
        // Matrices that are no rotations count too.
        if (i % 7 == 0)
            to.setBasis(to.getBasis().scaled(vec(1 + size, 1, 1 - 2 * size)));
        watched.body.setWorldTransform(from);
        watched.rest();
        watched.body.setWorldTransform(to);
        const double bound = double(watched.update());
        Wide largest = 0;
        for (int p = 0; p < ball->getNumPoints(); ++p)
        {
            const btVector3 point = ball->getScaledPoint(p);
            EXPECT_LE(distance(from, to, point), Wide(bound)) << i;
        }
        for (int k = 0; k < 6; ++k)
            largest = std::max(
                largest,
                distance(from, to, btScalar(k % 2 ? 1.3 : -1.3) * vec(k / 2 == 0, k / 2 == 1, k / 2 == 2)));
        tight += bound < 2 * double(largest);
        turned += size > 0.5;
    }
    EXPECT_GT(tight, 2000);
    EXPECT_GT(turned, 200);
}

TEST(BodyMotions, BoundHowMuchNearerTwoCoresMayCome)
{
    std::mt19937 engine(22);
    const auto ball = makeHullShape(ballPoints(12, 0.7, 3));
    Watched watched(*ball);
    int together = 0;
    for (int i = 0; i < 2000; ++i)
    {
        const double size = std::pow(10.0, random(engine, -7, 0)),
                     common = std::pow(10.0, random(engine, -7, 3));
        const double far = i % 3 == 0 ? 1e4 : 1.0;
        const btTransform from[2] = {btTransform(randomRotation(engine), vec(far, 0, -far)),
                                     btTransform(randomRotation(engine), vec(far, 1, 1 - far))};
        const btVector3 shift = btScalar(common) * quatRotate(randomRotation(engine), vec(1, 0, 0));
        btTransform to[2];
        for (int k = 0; k < 2; ++k)
        {
            to[k] = moved(from[k], size, random(engine, 0, 1), size, engine);
            to[k].setOrigin(to[k].getOrigin() + shift);
        }
        watched.body.setWorldTransform(from[0]);
        watched.anchor.setWorldTransform(from[1]);
        watched.rest();
        watched.body.setWorldTransform(to[0]);
        watched.anchor.setWorldTransform(to[1]);
        const Wide bound = Wide(watched.update());
        for (int p = 0; p < 12; ++p)
        {
            const btVector3 x = ball->getScaledPoint(p), y = ball->getScaledPoint(11 - p);
            Wide sum = 0;
            for (int axis = 0; axis < 3; ++axis)
            {
                const Wide d = difference(from[0], to[0], x, axis) - difference(from[1], to[1], y, axis);
                sum += d * d;
            }
            ASSERT_LE(std::sqrt(sum), bound) << i;
        }
        together += bound < Wide(common) / 10;
    }
    EXPECT_GT(together, 400);
}

TEST(BodyMotions, WhateverChangesTheCoreIsAnUnknownMotion)
{
    const float unknown = std::numeric_limits<float>::infinity();
    auto hull = makeHullShape(ballPoints(40, 0.5, 1));
    auto other = makeHullShape(ballPoints(40, 0.5, 1));
    btBoxShape box(vec(1, 1, 1));
    btSphereShape sphere(1);
    btCapsuleShape capsule(1, 1);
    Watched watched(*hull);
    const auto expectUnknownOnce = [&](const char* what)
    {
        EXPECT_EQ(watched.update(), unknown) << what;
        EXPECT_EQ(watched.update(), 0.0f) << what;
    };
    watched.rest();
    hull->setMargin(btScalar(0.1));
    expectUnknownOnce("margin");
    hull->setLocalScaling(vec(1, 1, 2));
    expectUnknownOnce("scaling");
    hull->addPoint(vec(0, 2, 0));
    expectUnknownOnce("a point more");
    hull->getUnscaledPoints()[40].setY(btScalar(1.5));
    expectUnknownOnce("a point elsewhere");
    hull->getUnscaledPoints()[40].setY(btScalar(2));
    expectUnknownOnce("a point back again");
    watched.body.setCollisionShape(other.get());
    expectUnknownOnce("another hull");
    watched.body.setCollisionShape(&box);
    expectUnknownOnce("a box");
    box.setLocalScaling(vec(2, 1, 1));
    expectUnknownOnce("scaling of a box");
    watched.body.setCollisionShape(&sphere);
    expectUnknownOnce("a sphere");
    sphere.setUnscaledRadius(2);
    expectUnknownOnce("the radius of a sphere");
    EXPECT_EQ(watched.update(true), unknown) << "updates were missed";
    EXPECT_EQ(watched.update(), 0.0f);
    watched.body.getWorldTransform().setOrigin(vec(std::numeric_limits<double>::quiet_NaN(), 0, 0));
    EXPECT_FALSE(watched.update() < unknown);
    watched.body.setCollisionShape(&capsule);
    for (int i = 0; i < 3; ++i)
        EXPECT_EQ(watched.update(), unknown) << "a kind that is not watched";
}

TEST(BodyMotions, OfNoUseAreLeftAloneForSomeTime)
{
    btSphereShape sphere(1);
    Watched watched(sphere);
    watched.rest();
    int unknown = 0;
    for (int i = 0; i < 160; ++i)
    {
        // What happens in a pause must not be taken for rest.
        watched.body.getWorldTransform().getOrigin() += vec(1, 0, 0);
        const float moved = watched.updateUnused();
        unknown += moved == std::numeric_limits<float>::infinity();
        EXPECT_GE(moved, 1.0f);
    }
    EXPECT_EQ(unknown, 150);
    for (int i = 0; i < 20; ++i)
        watched.update();
    EXPECT_EQ(watched.update(), 0.0f) << "found again";
}

TEST(BodyMotions, ServeOneCacheAtATimeAndReuseTheirPlaces)
{
    btSphereShape sphere(1);
    btCollisionObject bodies[3];
    for (btCollisionObject& body : bodies)
        body.setCollisionShape(&sphere);
    btHashedOverlappingPairCache first, second;
    BodyMotions motions;
    EXPECT_TRUE(motions.serves(&first));
    EXPECT_TRUE(motions.serves(&second));
    const std::uint32_t a = motions.acquire(bodies[0]), b = motions.acquire(bodies[1]);
    EXPECT_NE(a, b);
    EXPECT_EQ(motions.acquire(bodies[0]), a);
    EXPECT_FALSE(motions.serves(&first));
    motions.release(a);
    motions.release(b);
    EXPECT_EQ(motions.acquire(bodies[0]), a) << "still watched";
    EXPECT_EQ(motions.acquire(bodies[2]), b);
    motions.release(a);
    motions.release(a);
    motions.release(b);
    EXPECT_TRUE(motions.serves(&first));
    EXPECT_EQ(motions.size(), 2u);
}

TEST(Leeway, IsNeverMoreThanWhatTheMotionsHaveLeft)
{
    std::mt19937 engine(4);
    int lasted = 0;
    for (int round = 0; round < 200; ++round)
    {
        const double start = std::pow(10.0, random(engine, -4, 2));
        Leeway leeway;
        EXPECT_FALSE(leeway.outlasts(0.0f));
        leeway.set(start);
        Wide left = start;
        for (int i = 0; i < 1000; ++i)
        {
            const float step = float(start * std::pow(10.0, random(engine, -9, -2.2)));
            left -= Wide(step);
            if (!leeway.outlasts(step))
                break;
            ASSERT_GE(left, 0) << round;
            ++lasted;
        }
        EXPECT_FALSE(leeway.outlasts(float(start)));
        EXPECT_FALSE(leeway.outlasts(0.0f)) << "what is lost stays lost";
    }
    EXPECT_GT(lasted, 50000);
    Leeway leeway;
    leeway.set(0.0);
    EXPECT_TRUE(leeway.outlasts(0.0f));
    EXPECT_FALSE(leeway.outlasts(std::numeric_limits<float>::min()));
    leeway.set(1.0);
    EXPECT_FALSE(leeway.outlasts(std::numeric_limits<float>::quiet_NaN()));
    EXPECT_FALSE(leeway.outlasts(0.0f));
    leeway.set(std::numeric_limits<double>::max());
    EXPECT_FALSE(leeway.outlasts(2e38f)) << "no longer endless";
    leeway.set(1.0);
    leeway.forget();
    EXPECT_FALSE(leeway.outlasts(0.0f));
}
}  // namespace cullet::test
