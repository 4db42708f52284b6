// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/narrow/faulty_support.h"
#include "cullet/tests/narrow/search_observer.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <string>
#include <vector>

/// Which axes a search tests, as its observer sees them.
namespace cullet::test
{
namespace
{
struct SeenAxis
{
    Eigen::Vector3d axis;
    double along;
};

/// An observer, and what it has seen.
class Seen
{
public:
    SearchObserver observer = [this](const Eigen::Vector3d& axis, double along) {
        axes.push_back({axis, along});
    };
    std::vector<SeenAxis> axes;
};

double cosine(const Eigen::Vector3d& a, const Eigen::Vector3d& b)
{
    return a.normalized().dot(b.normalized());
}

template <class S>
class SearchObservers : public testing::Test
{
};
using ObserverScalars = testing::Types<float, double>;
TYPED_TEST_SUITE(SearchObservers, ObserverScalars, );

template <class S>
std::array<Hull<S>, 4> someHulls()
{
    return {hullOf<S>(icoPoints(2)), hullOf<S>(boxPoints(0.7, 0.5, 0.6)), hullOf<S>(prismPoints(32, 0.5)),
            hullOf<S>(icoPoints(0))};
}

TYPED_TEST(SearchObservers, SeeTheAxisThatProvesASeparationLast)
{
    using S = TypeParam;
    constexpr unsigned kSeed = 91;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    const std::array<Hull<S>, 4> hulls = someHulls<S>();
    std::mt19937 engine(kSeed);
    int proofs = 0, ofOneAxis = 0;
    for (std::size_t pair = 0; pair < 160; ++pair)
    {
        const S limit = pair % 3 == 0 ? S(0) : pair % 3 == 1 ? S(0.002) : S(0.02);
        PairScene<S> scene =
            randomPair(hulls[pair % 4], hulls[pair / 4 % 4], 1.2 * double(limit) + 0.002, 0.0, engine);
        GjkCache<S> cache;
        // A pair without history may be proved by balls, which have no support points.
        isaGjk(scene.posedA(), scene.posedB(), limit, cache);
        for (int frame = 0; frame < 12; ++frame)
        {
            perturb(scene, 0.002, engine);
            Seen seen;
            const GjkResult<S> result = isaGjk(scene.posedA(), scene.posedB(), limit, cache, seen.observer);
            if (result.state != GjkState::Separated)
                continue;
            ++proofs;
            ASSERT_FALSE(seen.axes.empty()) << "pair " << pair << " frame " << frame;
            ofOneAxis += seen.axes.size() == 1;
            const SeenAxis& last = seen.axes.back();
            EXPECT_GT(cosine(last.axis, result.axis.template cast<double>()), 1.0 - 1e-6);
            EXPECT_GE(last.along, double(limit) * last.axis.norm()) << "pair " << pair << " frame " << frame;
        }
    }
    EXPECT_GT(proofs, 800);
    EXPECT_GT(ofOneAxis, proofs / 2);
    EXPECT_LT(ofOneAxis, proofs);
}

TYPED_TEST(SearchObservers, SeeTheLineBetweenCentresFirstWhenAPairHasNoHistory)
{
    using S = TypeParam;
    constexpr unsigned kSeed = 92;
    const std::array<Hull<S>, 4> hulls = someHulls<S>();
    std::mt19937 engine(kSeed);
    int asked = 0;
    for (std::size_t pair = 0; pair < 80; ++pair)
    {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", pair " + std::to_string(pair));
        const PairScene<S> scene = randomPair(hulls[pair % 4], hulls[pair / 4 % 4], 0.01, 1.0, engine);
        const PosedHull<S> a = scene.posedA(), b = scene.posedB();
        const Eigen::Vector3d line = a.centre() + a.origin() - b.centre() - b.origin();
        GjkCache<S> ofMemory, ofAxis, ofDistance;
        Seen memory, axis, distance;
        isaGjk(a, b, S(0), ofMemory, memory.observer);
        isaGjk(a, b, S(0), ofAxis, axis.observer, IsaGjkVariant{GjkStart::Axis, 0});
        gjkDistance(a, b, S(1), ofDistance, distance.observer, GjkStart::Axis);
        for (const Seen* seen : {&memory, &axis, &distance})
        {
            // Balls around the hulls may prove it in their own scalar, without a support point.
            if (seen == &memory && seen->axes.empty())
                continue;
            ASSERT_FALSE(seen->axes.empty());
            EXPECT_GT(cosine(seen->axes[0].axis, line), 1.0 - 1e-6);
            ++asked;
        }
    }
    EXPECT_GT(asked, 200);
}

TEST(SearchObserver, SeesTheLineBetweenCentresFirstWhenShapesAreNoHulls)
{
    const std::array<Hull<float>, 4> hulls = someHulls<float>();
    std::mt19937 engine(96);
    for (std::size_t pair = 0; pair < 40; ++pair)
    {
        const PairScene<float> scene = randomPair(hulls[pair % 4], hulls[pair / 4 % 4], 0.01, 1.0, engine);
        const PosedHull<float> hullA = scene.posedA(), hullB = scene.posedB();
        const FaultySupport a(hullA, -1, 0.0), b(hullB, -1, 0.0);
        GjkCache<float> cache;
        Seen seen;
        isaGjk(a, b, 0.0f, cache, seen.observer);
        ASSERT_FALSE(seen.axes.empty());
        EXPECT_GT(cosine(seen.axes[0].axis, a.centre() + a.origin() - b.centre() - b.origin()), 1.0 - 1e-6)
            << "seed 96, pair " << pair;
    }
}

TYPED_TEST(SearchObservers, SeeARegularTetrahedronOfAxesWhenASearchStartsFromFour)
{
    using S = TypeParam;
    const std::array<Hull<S>, 4> hulls = someHulls<S>();
    std::mt19937 engine(93);
    const PairScene<S> scene = randomPair(hulls[0], hulls[1], -0.1, 0.0, engine);
    GjkCache<S> ofDistance, ofOverlap;
    Seen distance, overlap;
    gjkDistance(scene.posedA(), scene.posedB(), S(1), ofDistance, distance.observer,
                GjkStart::FourDirections);
    isaGjk(scene.posedA(), scene.posedB(), S(0), ofOverlap, overlap.observer,
           IsaGjkVariant{GjkStart::FourDirections, 0});
    for (const Seen* seen : {&distance, &overlap})
    {
        ASSERT_GE(seen->axes.size(), 4u);
        for (std::size_t i = 0; i < 4; ++i)
        {
            for (std::size_t j = 0; j < i; ++j)
                EXPECT_NEAR(cosine(seen->axes[i].axis, seen->axes[j].axis), -1.0 / 3.0, 1e-12);
        }
    }
}

TYPED_TEST(SearchObservers, SeeFewAxesOfADistanceWhoseSimplexIsRemembered)
{
    using S = TypeParam;
    constexpr unsigned kSeed = 94;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    const std::array<Hull<S>, 4> hulls = someHulls<S>();
    std::mt19937 engine(kSeed);
    std::size_t warm = 0, cold = 0;
    for (std::size_t pair = 0; pair < 40; ++pair)
    {
        PairScene<S> scene = randomPair(hulls[pair % 4], hulls[pair / 4 % 4], 0.1, 0.0, engine);
        GjkCache<S> cache;
        gjkDistance(scene.posedA(), scene.posedB(), S(1), cache);
        for (int frame = 0; frame < 10; ++frame)
        {
            perturb(scene, 0.001, engine);
            GjkCache<S> fresh;
            Seen seenWarm, seenCold;
            // Not through gjkDistance(), which answers most of these without a search.
            GjkResult<S> result;
            gjkSearch(scene.posedA(), scene.posedB(), S(1), cache, seenWarm.observer, GjkStart::Memory,
                      result);
            gjkSearch(scene.posedA(), scene.posedB(), S(1), fresh, seenCold.observer, GjkStart::Axis, result);
            warm += seenWarm.axes.size();
            cold += seenCold.axes.size();
        }
    }
    EXPECT_LT(warm, cold / 2);
}

TEST(FirstAxis, IsTheLineFromTheCentreOfBToThatOfAWithLargestComponentOne)
{
    const Hull<float> box =
        hullOf<float>(moved(boxPoints(1.0, 0.5, 0.25), Eigen::Matrix3d::Identity(), {1, 2, 3}));
    std::mt19937 engine(95);
    for (int i = 0; i < 20; ++i)
    {
        const Eigen::Matrix3f turnA = randomRotation(engine).cast<float>(),
                              turnB = randomRotation(engine).cast<float>();
        const PosedHull<float> a(box, turnA, randomDirection(engine).cast<float>());
        const PosedHull<float> b(box, turnB, randomDirection(engine).cast<float>());
        const std::array<float, 3> first = firstAxis(a, b);
        const Eigen::Vector3d axis(first[0], first[1], first[2]);
        EXPECT_GT(cosine(axis, a.centre() + a.origin() - b.centre() - b.origin()), 1.0 - 1e-6);
        EXPECT_FLOAT_EQ(static_cast<float>(axis.cwiseAbs().maxCoeff()), 1.0f);
        // Concentric shapes have no line; any axis will do.
        const std::array<float, 3> any = firstAxis(a, a);
        EXPECT_EQ(std::max({std::abs(any[0]), std::abs(any[1]), std::abs(any[2])}), 1.0f);
    }
}
}  // namespace
}  // namespace cullet::test
