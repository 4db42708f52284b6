// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_points.h"
#include "cullet/narrow/gjk/gjk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace cullet::test
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;
using LongVector = Eigen::Matrix<long double, 3, 1>;

constexpr unsigned kSeed = 7;

/// The gap of A and B along a direction, in long double.
long double gapAlong(const PosedHull<double>& a, const PosedHull<double>& b, const Vector3d& direction)
{
    const LongVector along = direction.cast<long double>();
    const auto heightOf = [&](const PosedHull<double>& posed, std::int32_t v)
    {
        const LongVector corner = posed.hull().vertex(v).cast<long double>();
        return along.dot(posed.basis().cast<long double>() * corner + posed.origin().cast<long double>());
    };
    long double lowest = std::numeric_limits<long double>::infinity(), highest = -lowest;
    for (std::int32_t v = 0; v < a.vertexCount(); ++v)
        lowest = std::min(lowest, heightOf(a, v));
    for (std::int32_t v = 0; v < b.vertexCount(); ++v)
        highest = std::max(highest, heightOf(b, v));
    return (lowest - highest) / along.norm();
}
}  // namespace

/// The distance is the largest gap along any direction, so that one with this gap proves it.
TEST(GjkLevelFaces, HaveAxisWithGapOfDistanceInDouble)
{
    const Hull<double> cube = hullOf<double>(boxPoints(1, 1, 1));
    constexpr double kSize = 5.5;
    std::mt19937_64 engine(kSeed);
    std::uniform_real_distribution<double> unit(-1, 1);
    const auto anyTurn = [&](double angle)
    {
        const double x = unit(engine), y = unit(engine), z = unit(engine);
        return Eigen::AngleAxisd(angle, Vector3d(x, y, z).normalized()).toRotationMatrix();
    };
    const auto powerBetween = [&](double low, double high)
    { return std::pow(10.0, low + (high - low) * (0.5 + 0.5 * unit(engine))); };
    constexpr int kPairs = 5000;
    int coarse = 0;
    for (int i = 0; i < kPairs; ++i)
    {
        const double tilt = powerBetween(-16, -6), gap = powerBetween(-4, 0);
        const Matrix3d turn = anyTurn(3 * unit(engine)), leaning = turn * anyTurn(tilt);
        const double x = unit(engine), z = unit(engine);
        // A foot on a diagonal of the face, in its middle, or anywhere.
        const Vector3d beside(i % 5 == 0 ? 0 : x, 0, i % 5 == 0 ? 0 : i % 3 == 0 ? x : z);
        const PosedHull<double> a(cube, turn, turn * (0.5 * beside + Vector3d(0, 2 + gap, 0)));
        const PosedHull<double> b(cube, leaning, Vector3d::Zero());
        GjkCache<double> cache;
        const GjkResult<double> result = gjkDistance(a, b, 10.0, cache);
        ASSERT_EQ(result.state, GjkState::Near) << "seed " << kSeed << ", pair " << i;
        const long double missing = result.distance - gapAlong(a, b, result.axis);
        EXPECT_LT(missing, 1e-9L * kSize) << "seed " << kSeed << ", pair " << i << ", tilt " << tilt;
        coarse += missing > 1e-11L * kSize ? 1 : 0;
    }
    EXPECT_LT(coarse, kPairs / 200);
}
}  // namespace cullet::test
