// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/narrow/hull/planar_hull.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

namespace cullet::test
{
namespace
{
/// Points in a plane, padded as PlanarHull needs them.
template <class S>
struct Plane
{
    std::vector<S> x, y;
    std::int32_t count = 0;

    void add(double px, double py)
    {
        x.push_back(static_cast<S>(px));
        y.push_back(static_cast<S>(py));
        ++count;
    }
    PlanarPoints<S> padded()
    {
        x.resize(static_cast<std::size_t>(count));
        y.resize(static_cast<std::size_t>(count));
        x.resize(static_cast<std::size_t>(count) + 8, x[0]);
        y.resize(static_cast<std::size_t>(count) + 8, y[0]);
        return {x.data(), y.data(), count};
    }
    /// Twice the area of the triangle of three points.
    double area(std::int32_t i, std::int32_t j, std::int32_t k) const
    {
        const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j),
                   c = static_cast<std::size_t>(k);
        return (double(x[b]) - double(x[a])) * (double(y[c]) - double(y[a])) -
               (double(y[b]) - double(y[a])) * (double(x[c]) - double(x[a]));
    }
};

enum Kind
{
    Far,     ///< as a ball looks from one of its points: most points near the centre, few far away
    Disc,    ///< evenly in a disc
    Strip,   ///< in a strip: two edges come near the centre
    Circle,  ///< on a circle: all points are corners
    Kinds
};

template <class S>
Plane<S> drawPlane(Kind kind, std::int32_t count, std::mt19937& engine)
{
    std::uniform_real_distribution<double> part(0.0, 1.0);
    Plane<S> plane;
    for (std::int32_t i = 0; i < count; ++i)
    {
        const double u = part(engine), angle = 6.2831853 * part(engine);
        const double radius = kind == Far ? std::sqrt(u / (1.001 - u)) : kind == Circle ? 1.0 : std::sqrt(u);
        plane.add(radius * std::cos(angle), (kind == Strip ? 0.02 : 1.0) * radius * std::sin(angle));
    }
    return plane;
}

/// The corners counter-clockwise from the rightmost one on, by Andrew's monotone chain.
template <class S>
std::vector<std::int32_t> chainCorners(const Plane<S>& plane)
{
    std::vector<std::int32_t> order(static_cast<std::size_t>(plane.count)), corners;
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(),
              [&](std::int32_t l, std::int32_t r)
              { return plane.x[static_cast<std::size_t>(l)] < plane.x[static_cast<std::size_t>(r)]; });
    const auto add = [&](std::int32_t point, std::size_t least)
    {
        while (corners.size() > least && plane.area(corners[corners.size() - 2], corners.back(), point) <= 0)
            corners.pop_back();
        corners.push_back(point);
    };
    for (const std::int32_t point : order)
        add(point, 1);
    const std::size_t least = corners.size();
    for (auto point = order.rbegin() + 1; point != order.rend(); ++point)
        add(*point, least);
    corners.pop_back();
    std::rotate(corners.begin(), std::find(corners.begin(), corners.end(), order.back()), corners.end());
    return corners;
}

template <class S>
class PlanarHulls : public testing::Test
{
};
using PlanarScalars = testing::Types<float, double>;
TYPED_TEST_SUITE(PlanarHulls, PlanarScalars);

TYPED_TEST(PlanarHulls, HaveTheCornersOfAllPointsWhereverTheCentreIs)
{
    using S = TypeParam;
    constexpr unsigned kSeed = 41;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    std::uniform_int_distribution<std::int32_t> draw(3, 256);
    int found[Kinds] = {}, asked[Kinds] = {};
    for (int i = 0; i < 4000; ++i)
    {
        const Kind kind = static_cast<Kind>(i % Kinds);
        Plane<S> plane = drawPlane<S>(kind, draw(engine), engine);
        // In the middle, beside it, or outside.
        const S away = static_cast<S>(i / Kinds % 3) * S(0.7);
        const std::vector<std::int32_t> expected = chainCorners(plane);
        const PlanarHull<S> hull(plane.padded(), {away, S(0)});
        const std::vector<std::int32_t> corners(hull.begin(), hull.end());
        ++asked[kind];
        found[kind] += corners.empty() ? 0 : 1;
        if (expected.size() <= PlanarHull<S>::kMostCorners)
            ASSERT_EQ(corners, expected) << "plane " << i;
        else
            ASSERT_TRUE(corners.empty()) << "plane " << i;
    }
    for (const Kind kind : {Far, Disc, Strip})
        EXPECT_GT(found[kind], asked[kind] / 4) << kind;
    EXPECT_LT(found[Circle], asked[Circle] / 8);
}
}  // namespace
}  // namespace cullet::test
