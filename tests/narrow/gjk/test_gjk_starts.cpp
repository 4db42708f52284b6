// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/distance_oracle.h"
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/narrow/any_pair.h"
#include "cullet/tests/narrow/search_observer.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

/// Starts of a search: the cache of a pair, a corner, an axis, four directions, reflections.
namespace cullet::test
{
namespace
{
constexpr float kNoLimit = std::numeric_limits<float>::infinity();

std::vector<Hull<float>> queryHulls()
{
    std::vector<Hull<float>> hulls;
    for (const NamedPoints& shape : queryShapes())
        hulls.push_back(hullOf<float>(shape.points));
    return hulls;
}

TEST(Gjk, FindsAxesByReflectionWithoutChangingAnswers)
{
    const std::vector<Hull<float>> hulls = queryHulls();
    std::mt19937 engine(31);
    int axisCount = 0;
    SearchObserver observer = [&axisCount](const Eigen::Vector3d&, double) { ++axisCount; };
    int separatedCount = 0, overlapCount = 0, savedCount = 0;
    for (int i = 0; i < 3000; ++i)
    {
        const double gaps[] = {0.5, 0.06, 1e-3, 1e-5, -1e-4, -3e-3, -0.03, -0.2};
        PairScene<float> scene = anyPair(hulls, gaps[engine() % std::size(gaps)], 0.0, engine);
        std::array<GjkCache<float>, 4> caches;
        for (int frame = 0; frame < 5; ++frame)
        {
            const auto ask = [&](int reflections, GjkCache<float>& cache)
            {
                axisCount = 0;
                return isaGjk(scene.posedA(), scene.posedB(), 0.0f, cache, observer,
                              IsaGjkVariant{GjkStart::Memory, reflections});
            };
            const GjkResult<float> expected = ask(0, caches[0]);
            separatedCount += expected.state == GjkState::Separated;
            overlapCount += expected.state == GjkState::Overlapping;
            for (const int k : {1, 2, 3})
            {
                const GjkResult<float> result = ask(k * k, caches[k]);
                ASSERT_EQ(result.state, expected.state) << "pair " << i << " frame " << frame << " k " << k;
                const bool isReflected = result.iterations == 0 && axisCount > 1;
                savedCount += isReflected && result.state == GjkState::Separated;
            }
            perturb(scene, 0.01, engine);
        }
    }
    EXPECT_GT(separatedCount, 3000);
    EXPECT_GT(overlapCount, 3000);
    EXPECT_GT(savedCount, 1000);
}

TEST(Gjk, GivesSameAnswerFromEveryStart)
{
    const std::vector<Hull<float>> hulls = queryHulls();
    std::mt19937 engine(32);
    int stateCounts[4] = {}, atOnceCounts[3] = {};
    for (int i = 0; i < 3000; ++i)
    {
        SCOPED_TRACE(i);
        const double gaps[] = {0.5, 0.06, 1e-3, 1e-5, -1e-4, -3e-3, -0.03, -0.2};
        PairScene<float> scene = anyPair(hulls, gaps[engine() % std::size(gaps)], 0.0, engine);
        std::array<GjkCache<float>, 3> booleans, distances;
        for (int frame = 0; frame < 4; ++frame)
        {
            NoObserver observer;
            std::array<GjkResult<float>, 3> is, far;
            for (const GjkStart start : {GjkStart::Memory, GjkStart::Axis, GjkStart::FourDirections})
            {
                const auto k = static_cast<std::size_t>(start);
                is[k] = isaGjk(scene.posedA(), scene.posedB(), 0.0f, booleans[k], observer,
                               IsaGjkVariant{start, 0});
                far[k] = gjkDistance(scene.posedA(), scene.posedB(), kNoLimit, distances[k], observer, start);
                ASSERT_EQ(is[k].state, is[0].state);
                ASSERT_EQ(far[k].state, far[0].state);
                ASSERT_NEAR(far[k].distance, far[0].distance, 2e-7);
                atOnceCounts[k] += is[k].iterations == 0;
            }
            ++stateCounts[static_cast<int>(is[0].state)];
            perturb(scene, 0.01, engine);
        }
    }
    EXPECT_GT(stateCounts[static_cast<int>(GjkState::Separated)], 3000);
    EXPECT_GT(stateCounts[static_cast<int>(GjkState::Overlapping)], 3000);
    // The starts differ: the cache answers more queries at once, and four axes some.
    EXPECT_GT(atOnceCounts[0], atOnceCounts[1]);
    EXPECT_GT(atOnceCounts[1], atOnceCounts[2]);
    EXPECT_GT(atOnceCounts[2], 1000);
}

TEST(Gjk, TakesFewIterationsInCoherentMotion)
{
    const Hull<float> ico = hullOf<float>(icoPoints(1));
    std::mt19937 engine(21);
    double iterations[2] = {}, booleanIterations = 0.0;
    for (int pair = 0; pair < 50; ++pair)
    {
        PairScene<float> scene = randomPair(ico, ico, pair % 2 == 0 ? 0.05 : 0.3, 0.0, engine);
        GjkCache<float> warm, warmBoolean;
        for (int frame = 0; frame < 100; ++frame)
        {
            GjkCache<float> cold;
            iterations[0] += gjkDistance(scene.posedA(), scene.posedB(), kNoLimit, cold).iterations;
            iterations[1] += gjkDistance(scene.posedA(), scene.posedB(), kNoLimit, warm).iterations;
            booleanIterations += isaGjk(scene.posedA(), scene.posedB(), 0.0f, warmBoolean).iterations;
            perturb(scene, 0.002, engine);
        }
    }
    EXPECT_LT(iterations[1] / 5000.0, 0.6);
    EXPECT_GT(iterations[0], 1.5 * iterations[1]);
    EXPECT_LT(booleanIterations / 5000.0, 0.02);
}

TEST(Gjk, AnswersFromVerticesWhileTheyAreClosestPoints)
{
    const Hull<float> box = hullOf<float>(boxPoints(0.7, 0.5, 0.6));
    std::mt19937 engine(23);
    int answered = 0, refused = 0;
    for (int pair = 0; pair < 100; ++pair)
    {
        PairScene<float> scene = randomPair(box, box, 1.5, 0.0, engine);
        GjkCache<float> cache;
        for (int frame = 0; frame < 30; ++frame)
        {
            const auto a = scene.posedA(), b = scene.posedB();
            GjkCache<float> cold;
            const GjkResult<float> whole = gjkDistance(a, b, kNoLimit, cold);
            NoObserver observer;
            GjkResult<float> quick, limited;
            GjkCache<float> other = cache;
            if (cache.count == 1 && gjkFromVertices(a, b, kNoLimit, cache, observer, quick))
            {
                ++answered;
                ASSERT_EQ(quick.state, GjkState::Near);
                ASSERT_NEAR(quick.distance, whole.distance, 2e-7);
                ASSERT_LT((quick.axis - whole.axis).norm(), 1e-5);
                ASSERT_LT((quick.pointA - whole.pointA).norm(), 1e-5);
                ASSERT_LT((quick.pointB - whole.pointB).norm(), 1e-5);
                ASSERT_TRUE(gjkFromVertices(a, b, 0.9f * whole.distance, other, observer, limited));
                ASSERT_EQ(limited.state, GjkState::Separated);
                ASSERT_EQ(isaGjk(a, b, 0.9f * whole.distance, cache).state, GjkState::Separated);
                // A vertex on the opposite side of the box is never a closest point.
                other.verticesA[0] = static_cast<std::uint16_t>(box.opposite(cache.verticesA[0]));
                ASSERT_FALSE(gjkFromVertices(a, b, kNoLimit, other, observer, limited));
                other.verticesA = cache.verticesA;
                other.verticesB[0] = static_cast<std::uint16_t>(box.opposite(cache.verticesB[0]));
                ASSERT_FALSE(gjkFromVertices(a, b, kNoLimit, other, observer, limited));
            }
            else
                refused += cache.count == 1;
            gjkDistance(a, b, kNoLimit, cache);
            perturb(scene, 0.01, engine);
        }
    }
    EXPECT_GT(answered, 500);
    EXPECT_GT(refused, 20);
}

/// Two balls of radius 1 with this gap.
int axesOfBalls(float gap, float maxDistance, const IsaGjkVariant& variant, GjkState expected)
{
    const Hull<float> ball = hullOf<float>(icoPoints(2));
    const Eigen::Vector3f apart = Eigen::Vector3f(1, 2, -2) * ((2.0f + gap) / 3.0f);
    const PosedHull<float> a(ball, Eigen::Matrix3f::Identity(), apart);
    const PosedHull<float> b(ball, Eigen::Matrix3f::Identity(), Eigen::Vector3f::Zero());
    int count = 0;
    SearchObserver observer = [&count](const Eigen::Vector3d&, double) { ++count; };
    GjkCache<float> cache;
    EXPECT_EQ(isaGjk(a, b, maxDistance, cache, observer, variant).state, expected);
    return count;
}

TEST(Gjk, TestsOnlyLineBetweenCentresOfDistantShapesWhenItStartsWithAxis)
{
    EXPECT_EQ(axesOfBalls(0.2f, 0.0f, {GjkStart::Axis, 0}, GjkState::Separated), 1);
    EXPECT_EQ(axesOfBalls(0.2f, 0.1f, {GjkStart::Axis, 0}, GjkState::Separated), 1);
}

/// A reflection turns an axis that the shapes overlap along, not one that separates them by too little.
TEST(Gjk, ReflectsNoAxisWhenItSeparatesByLessThanLimit)
{
    const int axes = axesOfBalls(0.2f, 0.3f, {GjkStart::Axis, 0}, GjkState::Near);
    EXPECT_EQ(axesOfBalls(0.2f, 0.3f, {GjkStart::Axis, 9}, GjkState::Near), axes);
}

/// A hull given by its support function, which records the vertices from which its supports start.
class RecordingSupport
{
public:
    explicit RecordingSupport(const PosedHull<float>& hull) : m_hull(&hull) {}

    Eigen::Vector3d origin() const { return m_hull->origin(); }
    Eigen::Vector3d centre() const { return m_hull->centre(); }
    std::int32_t vertexCount() const { return m_hull->vertexCount(); }
    Eigen::Vector3d point(std::int32_t vertex) const { return m_hull->point(vertex); }
    SupportPoint support(const Eigen::Vector3d& direction, std::int32_t start) const
    {
        m_starts.push_back(start);
        return m_hull->support(direction, start);
    }
    const std::vector<std::int32_t>& starts() const { return m_starts; }

private:
    const PosedHull<float>* m_hull;
    mutable std::vector<std::int32_t> m_starts;
};

TEST(Gjk, TestsRememberedAxisFromItsSupportVerticesWhenShapesAreNoHulls)
{
    constexpr unsigned kSeed = 33;
    const Hull<float> ball = hullOf<float>(icoPoints(2));
    std::mt19937 engine(kSeed);
    for (int i = 0; i < 50; ++i)
    {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", pair " + std::to_string(i));
        const PairScene<float> scene = randomPair(ball, ball, 0.1, 0.0, engine);
        const PosedHull<float> posedA = scene.posedA(), posedB = scene.posedB();
        const RecordingSupport coldA(posedA), coldB(posedB), a(posedA), b(posedB);
        GjkCache<float> cache;
        ASSERT_EQ(gjkDistance(coldA, coldB, 1.0f, cache).state, GjkState::Near);
        ASSERT_GT(cache.count, 0);
        EXPECT_EQ(coldA.starts()[0], -1);
        EXPECT_EQ(coldB.starts()[0], -1);
        // Another axis than the simplex has.
        Eigen::Vector3d seen = Eigen::Vector3d::Zero();
        int axes = 0;
        SearchObserver observer = [&](const Eigen::Vector3d& v, double)
        {
            seen = v;
            ++axes;
        };
        cache.axis[0] += 0.01f;
        const Eigen::Vector3d axis(cache.axis[0], cache.axis[1], cache.axis[2]);
        const std::int32_t startA = cache.startA, startB = cache.startB;
        EXPECT_EQ(isaGjk(a, b, 0.0f, cache, observer).state, GjkState::Separated);
        EXPECT_EQ(axes, 1);
        EXPECT_EQ(seen, axis);
        EXPECT_EQ(a.starts(), std::vector<std::int32_t>{startA});
        EXPECT_EQ(b.starts(), std::vector<std::int32_t>{startB});
    }
}

/// Number of pairs without a cache that the axis between the centres, or the corner where it fails, answers.
int settledAtOnce(double gap, GjkState state, std::mt19937& engine)
{
    const Hull<float> hulls[] = {
        hullOf<float>(icoPoints(1)), hullOf<float>(ellipsoidPoints(50, {1.0, 0.7, 0.5}, 50)),
        hullOf<float>(boxPoints(0.7, 0.5, 0.6)), hullOf<float>(prismPoints(32, 0.5))};
    int count = 0;
    for (int pair = 0; pair < 400; ++pair)
    {
        const Hull<float>& hullA = hulls[pair % 4];
        const Hull<float>& hullB = hulls[pair / 4 % 4];
        const PairScene<float> scene = randomPair(hullA, hullB, gap, 0.0, engine);
        GjkCache<float> cache;
        const GjkResult<float> result = isaGjk(scene.posedA(), scene.posedB(), 0.0f, cache);
        count += result.iterations == 0 && result.state == state;
    }
    return count;
}

TEST(Gjk, AnswersMostPairsWithoutHistoryFromFirstCorner)
{
    std::mt19937 engine(22);
    for (const double gap : {0.01, 0.001})
        EXPECT_GT(settledAtOnce(gap, GjkState::Separated, engine), 320) << gap;
    for (const double gap : {-0.01, -0.05})
        EXPECT_GT(settledAtOnce(gap, GjkState::Overlapping, engine), 220) << gap;
}

/// Checks a query for a gap with the cache of the previous frame.
///
/// @return number of axes tested to prove the gap, 0 if a simplex was needed or there is no such gap
int axesForGap(const PairScene<float>& scene, float limit, GjkCache<float>& cache)
{
    int tried = 0;
    SearchObserver observer = [&tried](const Eigen::Vector3d&, double) { ++tried; };
    const GjkResult<float> result = isaGjk(scene.posedA(), scene.posedB(), limit, cache, observer);
    const DistanceOracle oracle(scene.posedA(), scene.posedB());
    if (result.state == GjkState::Separated)
    {
        EXPECT_GT(-oracle.extent(-result.axis.cast<long double>()),
                  static_cast<long double>(limit) * (1 - 1e-6L));
        return result.iterations == 0 ? tried : 0;
    }
    const Bounds truth = oracle.solve();
    EXPECT_NE(result.state, GjkState::NotConverged);
    EXPECT_LT(truth.lower, static_cast<long double>(limit) + 1e-6L);
    return 0;
}

TEST(Gjk, ProvesRequestedGapFromCornerOfFailedAxis)
{
    const Hull<float> hulls[] = {hullOf<float>(icoPoints(2)), hullOf<float>(boxPoints(0.7, 0.5, 0.6)),
                                 hullOf<float>(prismPoints(32, 0.5)), hullOf<float>(icoPoints(0))};
    std::mt19937 engine(23);
    int queries = 0, proved = 0;
    for (int pair = 0; pair < 160; ++pair)
    {
        const float limit = pair % 3 == 0 ? 0.002f : 0.02f;
        PairScene<float> scene =
            randomPair(hulls[pair % 4], hulls[pair / 4 % 4], 1.5 * double(limit), 0.0, engine);
        GjkCache<float> cache;
        for (int frame = 0; frame < 12; ++frame, ++queries)
        {
            // For hulls of many vertices the axis is improved before the corner is used.
            const int axes = axesForGap(scene, limit, cache);
            proved += axes == 2 || axes == 3;
            perturb(scene, 0.003, engine);
        }
    }
    testing::Test::RecordProperty("proved", std::to_string(proved));
    // It would be an eighth with the corner used only where an axis does not separate at all.
    EXPECT_GT(proved, queries / 7);
}

TEST(Gjk, FindsBetterAxisOfTwoBallsByGradientStep)
{
    const Hull<float> ball = hullOf<float>(icoPoints(3));
    const Eigen::Matrix3f turn = Eigen::AngleAxisf(0.3f, Eigen::Vector3f(1, 2, 3).normalized()).matrix();
    const PosedHull<float> a(ball, turn, Eigen::Vector3f(2.03f, 0, 0));
    const PosedHull<float> b(ball, Eigen::Matrix3f::Identity(), Eigen::Vector3f::Zero());
    const float limit2 = 0.025f * 0.025f;
    const HullPair<float> pair(a, b);
    GjkCache<float> cache;
    cache.axis = {1.0f, 0.1f, -0.1f};
    const AxisTest<float> test = pair.test(Eigen::Vector3f(1.0f, 0.1f, -0.1f), limit2, -1, -1);
    ASSERT_FALSE(test.isProved);
    ASSERT_GT(test.along, 0.0f);
    NoObserver observer;
    GjkResult<float> result;
    AxisTest<float> again;
    ASSERT_TRUE(isaGjkGradientStep(pair, limit2, test, cache, observer, result, again));
    EXPECT_GT(again.along, test.along);
    EXPECT_EQ(result.state, GjkState::Separated);
    EXPECT_TRUE(
        pair.test(Eigen::Vector3f(cache.axis[0], cache.axis[1], cache.axis[2]), limit2, -1, -1).isProved);
    EXPECT_LT(std::abs(cache.axis[1]) + std::abs(cache.axis[2]), 0.1f);
}

/// Checks pairs of shapes of a size, without and with a cache, against the long double oracle.
template <class S>
void checkScale(double size, std::int64_t& separated, std::int64_t& near, std::int64_t& overlapping)
{
    std::mt19937 engine(5);
    for (const NamedPoints& shape : hullShapes())
    {
        if (shape.isThin)
            continue;
        const Points points = scaled(shape.points, size);
        const Hull<S> unit = hullOf<S>(shape.points), hull = hullOf<S>(points);
        for (int i = 0; i < 12; ++i)
        {
            PairScene<S> scene = randomPair(unit, unit, i % 3 == 0 ? -0.05 : 0.03, 0.0, engine);
            GjkCache<S> cache;
            for (int frame = 0; frame < 3; ++frame)
            {
                perturb(scene, 0.005, engine);
                const PosedHull<S> a(hull, scene.a.basis, scene.a.origin * S(size));
                const PosedHull<S> b(hull, scene.b.basis, scene.b.origin * S(size));
                const Bounds truth = DistanceOracle(a, b).solve();
                const S limit = frame == 2 ? S(0.04 * size) : S(0);
                const GjkState state = isaGjk(a, b, limit, cache).state;
                ASSERT_NE(state, GjkState::NotConverged) << shape.name << " " << size;
                const double slack = 2e-6 * size;
                if (state == GjkState::Separated)
                    ASSERT_GT(truth.upper, double(limit) - slack) << shape.name << " " << size;
                else if (state == GjkState::Near)
                    ASSERT_LT(truth.lower, double(limit) + slack) << shape.name << " " << size;
                else
                    ASSERT_LT(truth.lower, slack) << shape.name << " " << size;
                ++(state == GjkState::Separated ? separated : state == GjkState::Near ? near : overlapping);
                for (int k = 0; k < 3; ++k)
                    ASSERT_LE(std::abs(cache.axis[static_cast<std::size_t>(k)]), 1.0f);
            }
        }
    }
}

TEST(Gjk, GivesRightAnswersAtEveryScaleWithAndWithoutMemory)
{
    std::int64_t separated = 0, near = 0, overlapping = 0;
    // Beyond 1e6 and below 1e-6 the first axis is scaled before it is tested.
    for (const double size : {1e-8, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e8})
    {
        checkScale<float>(size, separated, near, overlapping);
        checkScale<double>(size, separated, near, overlapping);
    }
    EXPECT_GT(separated, 1000);
    EXPECT_GT(near, 200);
    EXPECT_GT(overlapping, 500);
}

TEST(Gjk, FindsOverlapWhenRememberedVerticesDoNotExist)
{
    const Hull<float> ball = hullOf<float>(icoPoints(2)), box = hullOf<float>(boxPoints(0.7, 0.5, 0.6));
    std::mt19937 engine(1);
    for (int i = 0; i < 100; ++i)
    {
        const Eigen::Vector3f place = (0.8 * randomDirection(engine)).cast<float>();
        const PosedHull<float> a(ball, Eigen::Matrix3f::Identity(), Eigen::Vector3f::Zero());
        const PosedHull<float> b(box, Eigen::Matrix3f::Identity(), place);
        GjkCache<float> cache;
        cache.state = GjkState::Overlapping;
        cache.count = 4;
        // Vertex ids that the box does not have.
        cache.verticesB = {100, 101, 102, 103};
        EXPECT_EQ(isaGjk(a, b, 0.0f, cache).state, GjkState::Overlapping) << "seed 1, pair " << i;
    }
}

TEST(Gjk, DoesNotOverstateGapOfFirstAxisInDouble)
{
    const Hull<double> prism = hullOf<double>(prismPoints(200, 0.5));
    std::mt19937 engine(3);
    std::uniform_real_distribution<double> exponent(-10.0, -8.0);
    int separated = 0, near = 0;
    double worst = -1.0;
    for (int i = 0; i < 400; ++i)
    {
        // One above the other, so that the axis between the centres is nearly the best.
        const Eigen::Matrix3d turn = randomRotation(engine);
        const double gap = 0.01 + (i % 2 == 0 ? 1.0 : -1.0) * std::pow(10.0, exponent(engine));
        const double height = 2.0 * prism.z()[0] < 0.0 ? -2.0 * prism.z()[0] : 2.0 * prism.z()[0];
        const PosedHull<double> a(prism, turn, Eigen::Vector3d::Zero());
        const PosedHull<double> b(prism, turn, turn.col(2) * (height + gap));
        const DistanceOracle oracle(a, b);
        const double truth = static_cast<double>(oracle.solve().upper);
        GjkCache<double> cache;
        // By how much the bound of an axis exceeds the exact distance.
        SearchObserver observer = [&](const Eigen::Vector3d& v, double along)
        { worst = std::max(worst, static_cast<double>(along / v.cast<long double>().norm()) - truth); };
        const GjkState state = isaGjk(a, b, 0.01, cache, observer).state;
        separated += state == GjkState::Separated ? 1 : 0;
        near += state == GjkState::Near ? 1 : 0;
        EXPECT_TRUE(state != GjkState::Separated || truth > 0.01 - 1e-13) << "seed 3, pair " << i;
    }
    EXPECT_GT(separated, 100);
    EXPECT_GT(near, 100);
    EXPECT_LT(worst, 1e-13);
}
}  // namespace
}  // namespace cullet::test
