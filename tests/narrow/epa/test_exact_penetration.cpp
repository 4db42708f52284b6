// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/epa/exact_penetration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
struct Arc
{
    Eigen::Vector3d from, to;
};

/// Whether the shorter great arcs intersect beyond rounding.
bool doCross(const Arc& a, const Arc& b)
{
    const Eigen::Vector3d acrossA = a.from.cross(a.to), acrossB = b.from.cross(b.to);
    const Eigen::Vector3d line = acrossA.cross(acrossB);
    for (const double sign : {1.0, -1.0})
    {
        const Eigen::Vector3d p = sign * line;
        const bool isOnA = a.from.cross(p).dot(acrossA) > 0.0 && p.cross(a.to).dot(acrossA) > 0.0;
        const bool isOnB = b.from.cross(p).dot(acrossB) > 0.0 && p.cross(b.to).dot(acrossB) > 0.0;
        if (isOnA && isOnB)
            return true;
    }
    return false;
}

std::vector<Arc> randomArcs(int count, std::mt19937& engine)
{
    // From a ten thousandth of the radius to nearly half a circle.
    std::uniform_real_distribution<double> power(-4.0, 1.5);
    std::vector<Arc> arcs;
    while (static_cast<int>(arcs.size()) < count)
    {
        const Eigen::Vector3d from = randomDirection(engine);
        const Eigen::Vector3d aside = randomDirection(engine);
        arcs.push_back({from, (from + std::pow(10.0, power(engine)) * aside).normalized()});
    }
    return arcs;
}

/// Smallest extent over all face normals and all cross products of two edges, each by all vertices.
double leastExtent(const PlacedHull& a, const PlacedHull& b)
{
    double least = std::numeric_limits<double>::infinity();
    const auto see = [&](const Eigen::Vector3d& normal)
    {
        if (normal.norm() > 0.5)
            least = std::min(least, a.extent(normal) + b.extent(normal));
    };
    for (const PlacedHull* hull : {&a, &b})
    {
        for (const Eigen::Vector3d& normal : hull->normals)
            see(normal);
    }
    for (const PlacedHull::Edge& ea : a.edges)
    {
        for (const PlacedHull::Edge& eb : b.edges)
        {
            const Eigen::Vector3d across = ea.direction.cross(eb.direction);
            if (across.norm() < 1e-9 * ea.direction.norm() * eb.direction.norm())
                continue;
            see(across.normalized());
            see(-across.normalized());
        }
    }
    return least;
}
}  // namespace

TEST(GaussMapArcs, FindEveryCrossingPairOnce)
{
    constexpr unsigned kSeed = 20;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    int crossings = 0, pairs = 0;
    constexpr int kArcs = 150;
    for (int round = 0; round < 20; ++round)
    {
        const std::vector<Arc> first = randomArcs(kArcs, engine), second = randomArcs(kArcs, engine);
        GaussMapArcs a, b;
        for (int i = 0; i < kArcs; ++i)
        {
            a.add(first[i].from, first[i].to);
            b.add(second[i].from, second[i].to);
        }
        a.sort();
        b.sort();
        std::set<std::pair<std::size_t, std::size_t>> found;
        GaussMapArcs::forEachPair(a, b,
                                  [&](std::size_t i, std::size_t j)
                                  { EXPECT_TRUE(found.emplace(i, j).second) << i << ' ' << j; });
        pairs += static_cast<int>(found.size());
        for (std::size_t i = 0; i < kArcs; ++i)
        {
            for (std::size_t j = 0; j < kArcs; ++j)
            {
                if (!doCross(first[i], second[j]))
                    continue;
                ++crossings;
                EXPECT_EQ(found.count({i, j}), 1u) << i << ' ' << j;
            }
        }
    }
    EXPECT_GT(crossings, 3000);
    EXPECT_LT(pairs, 20 * kArcs * kArcs / 2);
}

/// Short arcs around a direction with this coordinate on an axis, and two equal ones on the others.
GaussMapArcs arcsAround(int axis, double coordinate, std::mt19937& engine)
{
    Eigen::Vector3d middle = Eigen::Vector3d::Constant(std::sqrt(0.5 * (1.0 - coordinate * coordinate)));
    middle[axis] = coordinate;
    GaussMapArcs arcs;
    for (int i = 0; i < 10; ++i)
    {
        const Eigen::Vector3d to = (middle + 0.1 * randomDirection(engine)).normalized();
        arcs.add(middle, to);
    }
    arcs.sort();
    return arcs;
}

TEST(GaussMapArcs, PairNoArcsThatOneAxisSeparates)
{
    constexpr unsigned kSeed = 24;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    for (int axis = 0; axis < 3; ++axis)
    {
        SCOPED_TRACE(axis);
        const GaussMapArcs low = arcsAround(axis, -0.4, engine), high = arcsAround(axis, 0.4, engine),
                           other = arcsAround(axis, 0.4, engine);
        int apart = 0, together = 0;
        GaussMapArcs::forEachPair(low, high, [&](std::size_t, std::size_t) { ++apart; });
        GaussMapArcs::forEachPair(high, low, [&](std::size_t, std::size_t) { ++apart; });
        GaussMapArcs::forEachPair(high, other, [&](std::size_t, std::size_t) { ++together; });
        EXPECT_EQ(apart, 0);
        EXPECT_EQ(together, 100);
    }
}

TEST(GaussMapArcs, PairArcOfInvalidEndWithEveryOther)
{
    std::mt19937 engine(21);
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinite = HUGE_VAL;
    GaussMapArcs a, b;
    a.add(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX());
    a.add(Eigen::Vector3d::UnitY(), Eigen::Vector3d(kNan, 0.0, 0.0));
    a.add(Eigen::Vector3d(0.0, kInfinite, 0.0), Eigen::Vector3d(kNan, kNan, kNan));
    a.sort();
    for (const Arc& arc : randomArcs(50, engine))
        b.add(arc.from, arc.to);
    b.sort();
    int found = 0;
    GaussMapArcs::forEachPair(a, b, [&](std::size_t, std::size_t) { ++found; });
    GaussMapArcs::forEachPair(b, a, [&](std::size_t, std::size_t) { ++found; });
    EXPECT_EQ(found, 300);
}

TEST(ExactPenetration, EqualsLeastExtentAlongFaceNormalsAndEdgeProducts)
{
    constexpr unsigned kSeed = 22;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    const std::vector<Points> sets = {icoPoints(0),
                                      icoPoints(1),
                                      boxPoints(0.7, 0.5, 0.6),
                                      ellipsoidPoints(30, {1.0, 0.7, 0.5}, 50),
                                      prismPoints(24, 0.5),
                                      boxPoints(1.0, 0.001, 0.001),
                                      boxPoints(1.0, 1.0, 0.0),
                                      {{-1, 0, 0}, {1, 0, 0}}};
    std::map<bool, int> depths;
    for (const Points& first : sets)
    {
        for (const Points& second : sets)
        {
            const Hull<float> hullA = hullOf<float>(first), hullB = hullOf<float>(second);
            for (const double apart : {0.0, 1e-3, 0.3, 0.6, 0.9, 1.2})
            {
                const Eigen::Vector3f from = (apart * randomDirection(engine)).cast<float>();
                const PosedHull<float> a(hullA, randomRotation(engine).cast<float>(),
                                         Eigen::Vector3f::Zero());
                const PosedHull<float> b(hullB, randomRotation(engine).cast<float>(), from);
                Eigen::Vector3d normal;
                double depth = 0.0;
                const bool isKnown = exactPenetration(a, b, normal, depth);
                const double least = leastExtent(PlacedHull(a, Eigen::Vector3d::Zero(), 1.0),
                                                 PlacedHull(b, b.origin() - a.origin(), -1.0));
                ASSERT_EQ(isKnown, std::isfinite(least));
                // For separated hulls another direction may have the smallest extent, which is no depth.
                if (least < 0.0)
                    continue;
                ++depths[least > 0.05];
                EXPECT_NEAR(depth, least, 1e-12);
            }
        }
    }
    EXPECT_GT(depths[true], 50);
    EXPECT_GT(depths[false], 5);
}

TEST(ExactPenetration, TestsFewEdgePairsOfRoundHulls)
{
    const Hull<float> hull = hullOf<float>(icoPoints(4));
    std::mt19937 engine(23);
    const PosedHull<float> a(hull, Eigen::Matrix3f::Identity(), Eigen::Vector3f::Zero());
    const PosedHull<float> b(hull, randomRotation(engine).cast<float>(), Eigen::Vector3f::Zero());
    const PlacedHull placedA(a, Eigen::Vector3d::Zero(), 1.0), placedB(b, Eigen::Vector3d::Zero(), -1.0);
    const MinkowskiDepth sum(placedA, placedB);
    std::int64_t arcPairs = 0;
    GaussMapArcs::forEachPair(placedA.arcs, placedB.arcs, [&](std::size_t, std::size_t) { ++arcPairs; });
    const auto edges = static_cast<std::int64_t>(placedA.edges.size());
    EXPECT_EQ(edges, 7680);
    EXPECT_GT(arcPairs, edges);
    EXPECT_LT(arcPairs, 20 * edges);
    EXPECT_GT(sum.depth(), 1.99);
    EXPECT_LT(sum.depth(), 2.0);
}
}  // namespace cullet::test
