// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/body_motions.h"
#include "cullet/tests/plugin/random_motion.h"

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
using Wide = long double;

using Axis = std::array<float, 3>;

Wide along(const btVector3& v, const Axis& axis, int sign)
{
    Wide sum = 0;
    for (int k = 0; k < 3; ++k)
        sum += Wide(sign) * Wide(axis[std::size_t(k)]) * Wide(v[k]);
    return sum;
}

/// The highest product of an axis with a point of the core, relative to its origin.
Wide heightOf(const btConvexHullShape& core, const btTransform& place, const Axis& axis, int sign)
{
    Wide height = -std::numeric_limits<Wide>::infinity();
    for (int i = 0; i < core.getNumPoints(); ++i)
    {
        const btVector3 p = core.getScaledPoint(i);
        Wide product = 0;
        for (int k = 0; k < 3; ++k)
            product +=
                Wide(sign) * Wide(axis[std::size_t(k)]) *
                (Wide(place.getBasis()[k][0]) * Wide(p[0]) + Wide(place.getBasis()[k][1]) * Wide(p[1]) +
                 Wide(place.getBasis()[k][2]) * Wide(p[2]));
        height = std::max(height, product);
    }
    return height;
}

Wide reachOf(const btConvexHullShape& core)
{
    Wide reach = 0;
    for (int i = 0; i < core.getNumPoints(); ++i)
        reach = std::max(reach, Wide(core.getScaledPoint(i).length()));
    return reach;
}

/// Gap between A and B along an axis.
Wide gapOf(const btConvexHullShape& core, const btTransform& a, const btTransform& b, const Axis& axis)
{
    return along(a.getOrigin(), axis, 1) - along(b.getOrigin(), axis, 1) - heightOf(core, a, axis, -1) -
           heightOf(core, b, axis, 1);
}

Axis randomAxis(std::mt19937& engine)
{
    const btVector3 v = quatRotate(randomRotation(engine), vec(1, 0, 0));
    const btScalar largest = v.absolute()[v.absolute().maxAxis()];
    return {float(v.x() / largest), float(v.y() / largest), float(v.z() / largest)};
}

/// A body beside one that moves only on request; each test is a separate pass.
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

    float update(bool missedUpdates = false)
    {
        for (int i = 0; i < 8; ++i)
        {
            m_motions.use(m_place);
            m_motions.use(m_anchor);
        }
        m_motions.update(0, m_motions.size(), ++s_pass, missedUpdates);
        return approachBound({-1, 0, 0}, TurnRates(1.0f, 0.0f, 1.0f, 0.0f, 1.0f));
    }
    float approachBound(const Axis& axis, const TurnRates& rates) const
    {
        return m_motions.approachBound(m_place, m_anchor, axis, rates);
    }
    /// Records the position.
    void rest()
    {
        update();
        EXPECT_EQ(update(), 0.0f);
    }
    float updateUnused()
    {
        m_motions.update(0, m_motions.size(), ++s_pass, false);
        return approachBound({-1, 0, 0}, TurnRates(1.0f, 0.0f, 1.0f, 0.0f, 1.0f));
    }

    btCollisionObject body, anchor;

private:
    static inline std::uint64_t s_pass = std::uint64_t(1) << 40;
    BodyMotions m_motions;
    std::uint32_t m_place, m_anchor;
};
}  // namespace

TEST(BodyMotions, BoundHowMuchLessACoreReachesBeyondTheOther)
{
    std::mt19937 engine(22);
    const auto ball = makeHullShape(ballPoints(30, 0.7, 3));
    const auto plate = makeHullShape(ballPoints(30, 0.7, 3));
    plate->setLocalScaling(vec(1, -2, 0.25));
    int tight = 0, turned = 0, together = 0, sharper = 0;
    for (int i = 0; i < 4000; ++i)
    {
        SCOPED_TRACE(i);
        btConvexHullShape& core = i % 2 == 0 ? *ball : *plate;
        Watched watched(core);
        const double size = std::pow(10.0, random(engine, -6, 0)),
                     common = std::pow(10.0, random(engine, -7, 2));
        const double far = i % 3 == 0 ? 1e4 : 1.0;
        btTransform at[2] = {btTransform(randomRotation(engine), vec(far, 0, -far)),
                             btTransform(randomRotation(engine), vec(far, 1, 1 - far))};
        // Matrices that are no rotations are tested, too.
        if (i % 7 == 0)
            at[0].setBasis(at[0].getBasis().scaled(vec(1.001, 1, 0.9)));
        const auto place = [&]
        {
            watched.body.setWorldTransform(at[0]);
            watched.anchor.setWorldTransform(at[1]);
        };
        place();
        watched.rest();
        const Axis axis = randomAxis(engine);
        const Wide before = gapOf(core, at[0], at[1], axis);
        const auto reach = float(reachOf(core) * Wide(1.000001L));
        const float length2 = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2];
        const TurnRates rates(reach, float(heightOf(core, at[0], axis, -1)), reach,
                              float(heightOf(core, at[1], axis, 1)), length2);
        Wide bound = 0, turns = 0;
        for (int frame = 0; frame < 3; ++frame)
        {
            const btVector3 shift = btScalar(common) * quatRotate(randomRotation(engine), vec(1, 0, 0));
            for (btTransform& t : at)
            {
                t = moved(t, size, random(engine, 0, 1), size * (i % 5), engine);
                t.setOrigin(t.getOrigin() + shift);
            }
            place();
            watched.update();
            bound += Wide(watched.approachBound(axis, rates));
            turns += 2 * Wide(size) * Wide(reach) * std::sqrt(Wide(length2));
            const Wide lost = before - gapOf(core, at[0], at[1], axis);
            ASSERT_LE(lost, bound) << frame;
            tight += bound < lost + turns / 2;
        }
        turned += size > 0.3;
        together += bound < Wide(common) / 10;
        sharper += rates.a() < 0.4f || rates.b() < 0.4f;
    }
    EXPECT_GT(tight, 1000);
    EXPECT_GT(turned, 200);
    EXPECT_GT(together, 500);
    EXPECT_GT(sharper, 1000);
}

TEST(BodyMotions, AreUnknownAfterAnyChangeOfTheCore)
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
    watched.body.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    expectUnknownOnce("kinematic, which takes a manifold");
    watched.body.setCollisionFlags(0);
    expectUnknownOnce("no longer kinematic");
    EXPECT_EQ(watched.update(true), unknown) << "updates were missed";
    EXPECT_EQ(watched.update(), 0.0f);
    watched.body.getWorldTransform().setOrigin(vec(std::numeric_limits<double>::quiet_NaN(), 0, 0));
    EXPECT_FALSE(watched.update() < unknown);
    watched.body.setCollisionShape(&capsule);
    for (int i = 0; i < 3; ++i)
        EXPECT_EQ(watched.update(), unknown) << "a kind that is not watched";
}

TEST(BodyMotions, PauseLongerEachTimeTheyAreUnused)
{
    btSphereShape sphere(1);
    Watched watched(sphere);
    watched.rest();
    int unknown = 0;
    for (int i = 0; i < 160; ++i)
    {
        // A motion during a pause must not count as rest.
        watched.body.getWorldTransform().getOrigin() += vec(1, 0, 0);
        const float moved = watched.updateUnused();
        unknown += moved == std::numeric_limits<float>::infinity();
        EXPECT_GE(moved, 1.0f);
    }
    EXPECT_EQ(unknown, 155);
    // The third pause is the longest.
    int waited = 0;
    while (waited < 200 && watched.update() != 0.0f)
        ++waited;
    EXPECT_GT(waited, 4) << "left alone for longer than before";
    EXPECT_LT(waited, 98) << "found again";
    for (int i = 0; i < 10; ++i)
        EXPECT_EQ(watched.update(), 0.0f);
    // After a successful test the pause is as short as at first.
    for (int i = 0; i < 12; ++i)
    {
        watched.body.getWorldTransform().getOrigin() += vec(1, 0, 0);
        watched.updateUnused();
    }
    for (waited = 0; waited < 200 && watched.update() != 0.0f;)
        ++waited;
    EXPECT_LT(waited, 26);
}

TEST(BodyMotions, PauseEachBodyAsLongInManyRangesAsInOne)
{
    constexpr unsigned kSeed = 5;
    std::mt19937 engine(kSeed);
    btSphereShape sphere(1);
    std::vector<btCollisionObject> bodies(101);
    BodyMotions whole, divided;
    for (btCollisionObject& body : bodies)
    {
        body.setCollisionShape(&sphere);
        body.setWorldTransform(btTransform::getIdentity());
        ASSERT_EQ(whole.acquire(body), divided.acquire(body));
    }
    const std::size_t count = whole.size();
    std::uint64_t pass = std::uint64_t(1) << 42;
    int paused = 0, ended = 0;
    for (int update = 0; update < 150; ++update)
    {
        const bool wasPaused = whole.isPaused(0);
        whole.update(0, count, ++pass, false);
        for (std::size_t begin = 0, end = 0; begin < count; begin = end)
        {
            end = std::min<std::size_t>(count, begin + 1 + engine() % 20);
            divided.update(begin, end, pass, false);
        }
        for (std::uint32_t place = 0; place < count; ++place)
            ASSERT_EQ(whole.isPaused(place), divided.isPaused(place))
                << "seed " << kSeed << ", update " << update << ", place " << place;
        paused += whole.isPaused(0);
        ended += wasPaused && !whole.isPaused(0);
    }
    EXPECT_GT(paused, 100);
    EXPECT_GE(ended, 2);
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

TEST(BodyMotions, FreeTheirMemoryOnlyWhileNoPairTracksABody)
{
    btSphereShape shape(1);
    btCollisionObject a, b;
    a.setCollisionShape(&shape);
    b.setCollisionShape(&shape);
    BodyMotions motions;
    const std::uint32_t placeA = motions.acquire(a), placeB = motions.acquire(b);
    motions.release(placeA);
    motions.freeIfUnused();
    EXPECT_EQ(motions.size(), 2u) << "a pair of B will release it";
    motions.release(placeB);
    motions.freeIfUnused();
    EXPECT_EQ(motions.size(), 0u);
    EXPECT_EQ(motions.acquire(b), 0u);
    motions.release(0);
}

TEST(BodyMotions, ReadNoBodyAfterAbandonAndTrackItAgainInNewSlot)
{
    btSphereShape sphere(1);
    btCollisionObject bodies[2];
    for (btCollisionObject& body : bodies)
    {
        body.setCollisionShape(&sphere);
        body.setWorldTransform(btTransform::getIdentity());
    }
    BodyMotions motions;
    const std::uint32_t a = motions.acquire(bodies[0]), b = motions.acquire(bodies[1]);
    const TurnRates rates(1.0f, 0.0f, 1.0f, 0.0f, 1.0f);
    std::uint64_t pass = std::uint64_t(1) << 41;
    const auto update = [&] { motions.update(0, motions.size(), ++pass, false); };
    update();
    update();
    EXPECT_EQ(motions.approachBound(a, b, {1, 0, 0}, rates), 0.0f);
    motions.abandon();
    // Invalidates the data of a body that would be read.
    bodies[0].setCollisionShape(nullptr);
    bodies[1].setCollisionShape(nullptr);
    update();
    EXPECT_FALSE(motions.approachBound(a, b, {1, 0, 0}, rates) < std::numeric_limits<float>::infinity());
    EXPECT_TRUE(motions.isAbandoned(a));
    bodies[0].setCollisionShape(&sphere);
    const std::uint32_t again = motions.acquire(bodies[0]);
    EXPECT_NE(again, a);
    EXPECT_NE(again, b);
    EXPECT_FALSE(motions.isAbandoned(again));
    motions.release(a);
    EXPECT_EQ(motions.acquire(bodies[0]), again) << "still followed";
    motions.release(b);
    motions.release(again);
    motions.release(again);
    btHashedOverlappingPairCache other;
    EXPECT_TRUE(motions.serves(&other));
    EXPECT_EQ(motions.size(), 3u);
}

TEST(MotionTrackedPairs, RecogniseUnmovedAlgorithmsUnlessReplacedAtTheirAddress)
{
    using Kind = MotionTrackedPairs::Kind;
    // Only the addresses matter.
    alignas(16) unsigned char memory[6][192];
    const auto algorithm = [&](std::size_t i) { return reinterpret_cast<btCollisionAlgorithm*>(memory[i]); };
    std::vector<btBroadphasePair> pairs(6);
    MotionTrackedPairs watched;
    ASSERT_TRUE(watched.tryReserve(pairs.size()));
    EXPECT_EQ(watched.firstUnclassified(pairs.data(), 0, pairs.size()), 0u) << "pairs without algorithms";
    const auto learn = [&]
    {
        for (std::size_t i = 0; i < pairs.size(); ++i)
            watched.record(i, pairs[i].m_algorithm, Kind(i % 3));
        watched.endCount();
    };
    for (std::size_t i = 0; i < pairs.size(); ++i)
        pairs[i].m_algorithm = algorithm(i);
    watched.add();
    watched.add();
    learn();
    EXPECT_EQ(watched.trackingCount(), 2u);
    EXPECT_EQ(watched.trackingTotal(), 2u);
    EXPECT_EQ(watched.isaGjkPairs(), (std::vector<std::uint32_t>{0, 1, 3, 4}));
    EXPECT_EQ(watched.firstUnclassified(pairs.data(), 0, pairs.size()), 6u);
    std::swap(pairs[2].m_algorithm, pairs[4].m_algorithm);
    EXPECT_EQ(watched.firstUnclassified(pairs.data(), 0, pairs.size()), 2u);
    EXPECT_EQ(watched.firstUnclassified(pairs.data(), 3, pairs.size()), 4u);
    EXPECT_EQ(watched.firstUnclassified(pairs.data(), 5, pairs.size()), 6u);
    learn();
    watched.touch(*algorithm(3));
    watched.remove();
    EXPECT_EQ(watched.trackingTotal(), 1u);
    EXPECT_EQ(watched.firstUnclassified(pairs.data(), 0, pairs.size()), 3u);
    // A shorter array with a shorter list.
    pairs.resize(4);
    pairs[3].m_algorithm = nullptr;
    ASSERT_TRUE(watched.tryReserve(pairs.size()));
    watched.record(3, nullptr, Kind::Other);
    watched.endCount();
    EXPECT_EQ(watched.isaGjkPairs(), (std::vector<std::uint32_t>{0, 1}));
    EXPECT_EQ(watched.trackingCount(), 1u);
    EXPECT_EQ(watched.firstUnclassified(pairs.data(), 0, pairs.size()), 3u);
    watched.forget();
    EXPECT_EQ(watched.trackingTotal(), 1u);
    EXPECT_TRUE(watched.isaGjkPairs().empty());
    watched.clear();
    EXPECT_EQ(watched.trackingTotal(), 0u);
    ASSERT_TRUE(watched.tryReserve(pairs.size()));
    EXPECT_EQ(watched.firstUnclassified(pairs.data(), 0, pairs.size()), 0u);
}

TEST(SeparationBudget, DoesNotExceedDistanceThatMotionsLeave)
{
    std::mt19937 engine(4);
    int lasted = 0;
    for (int round = 0; round < 200; ++round)
    {
        const auto start = double(btScalar(std::pow(10.0, random(engine, -4, 2))));
        SeparationBudget leeway;
        EXPECT_FALSE(leeway.consume(0.0f));
        leeway.set({btScalar(start), {}});
        Wide left = start;
        for (int i = 0; i < 1000; ++i)
        {
            const float step = float(start * std::pow(10.0, random(engine, -9, -2.2)));
            left -= Wide(step);
            if (!leeway.consume(step))
                break;
            ASSERT_GE(left, 0) << round;
            ++lasted;
        }
        EXPECT_FALSE(leeway.consume(float(start)));
        EXPECT_FALSE(leeway.consume(0.0f)) << "what is lost stays lost";
    }
    EXPECT_GT(lasted, 50000);
    SeparationBudget leeway;
    leeway.set({0, {}});
    EXPECT_TRUE(leeway.consume(0.0f));
    EXPECT_FALSE(leeway.consume(std::numeric_limits<float>::min()));
    leeway.set({1, {}});
    EXPECT_FALSE(leeway.consume(std::numeric_limits<float>::quiet_NaN()));
    EXPECT_FALSE(leeway.consume(0.0f));
    leeway.set({std::numeric_limits<btScalar>::max(), {}});
    EXPECT_FALSE(leeway.consume(2e38f)) << "no longer endless";
    leeway.set({1, {}});
    leeway.forget();
    EXPECT_FALSE(leeway.consume(0.0f));
    EXPECT_TRUE(leeway.isForgotten());
}
}  // namespace cullet::test
