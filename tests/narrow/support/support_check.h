// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/paired_climb.h"
#include "cullet/narrow/hull/support.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

/// All support searches against a scan of the given points.
namespace cullet::test
{
/// Lowest index of the largest rounded product over all given points, as Bullet's scan finds it.
template <class S>
std::int32_t scanPoints(const std::vector<Eigen::Matrix<S, 3, 1>>& points, const Eigen::Matrix<S, 3, 1>& d)
{
    std::int32_t best = 0;
    S bestHeight = -std::numeric_limits<S>::infinity();
    for (std::size_t i = 0; i < points.size(); ++i)
    {
        const S height = points[i][0] * d[0] + points[i][1] * d[1] + points[i][2] * d[2];
        if (height > bestHeight)
        {
            best = static_cast<std::int32_t>(i);
            bestHeight = height;
        }
    }
    return best;
}

inline constexpr SupportMethod kMethods[] = {SupportMethod::Automatic, SupportMethod::Linear,
                                             SupportMethod::Climb,     SupportMethod::ClimbArtificial,
                                             SupportMethod::CubeMap,   SupportMethod::DobkinKirkpatrick};

template <class S>
struct Comparison
{
    Comparison(const Points& given)
        : points(castPoints<S>(given)), hull(makeHull(points, HullExtra::Hierarchy))
    {
    }

    /// Checks isPeak() at the answer, a neighbour of it and the start.
    void checkPeaks(const Eigen::Matrix<S, 3, 1>& d, std::int32_t start, std::int32_t expected)
    {
        if (!hull.hasNeighbours())
            return;
        const std::int32_t top = supportLinear(hull, d);
        const std::int32_t beside = hull.naturalNeighbours(top)[0];
        const S band = hull.tieBand() * (std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]));
        for (const std::int32_t vertex : {top, beside, start >= 0 ? start : beside})
        {
            S height;
            const bool isFound = isPeak(hull, vertex, LaneDirection<S>(d), band, height);
            ++peakCount;
            sureCount += isFound;
            if (isFound && hull.sourceIndex(vertex) != expected)
            {
                ++wrongCount;
                ADD_FAILURE() << "peak " << vertex << " top " << top << " direction " << d.transpose()
                              << " expected " << expected;
            }
        }
    }

    /// Checks climbBoth() along the direction and against it, in both orders.
    void checkBoth(const Eigen::Matrix<S, 3, 1>& d, std::int32_t start)
    {
        if (!hull.hasNeighbours())
            return;
        const std::int32_t top = supportLinear(hull, d), bottom = supportLinear<S>(hull, -d);
        const std::int32_t first = start >= 0 ? start : top;
        const VertexPair found = climbBoth<S>(hull, d, hull, -d, {first, first});
        const VertexPair swapped = climbBoth<S>(hull, -d, hull, d, {first, first});
        EXPECT_EQ(found.a, top) << "start " << start << " direction " << d.transpose();
        EXPECT_EQ(found.b, bottom) << "start " << start << " direction " << d.transpose();
        EXPECT_EQ(swapped.a, found.b);
        EXPECT_EQ(swapped.b, found.a);
    }

    /// Checks the hull of the corners, which the queries search: compares products, since another vertex may be level
    /// with the scan's.
    void checkCorners(const Eigen::Matrix<S, 3, 1>& d, std::int32_t start, std::int32_t expected)
    {
        const Hull<S>& corners = hull.corners();
        const auto exactHeight = [&d](const Eigen::Matrix<S, 3, 1>& p)
        { return p.template cast<long double>().dot(d.template cast<long double>()); };
        const long double highest = exactHeight(points[static_cast<std::size_t>(expected)]);
        const long double ulp = static_cast<long double>(std::numeric_limits<S>::epsilon()) *
                                static_cast<long double>(hull.radius()) *
                                d.template cast<long double>().norm();
        for (const SupportMethod method : kMethods)
        {
            if (method == SupportMethod::DobkinKirkpatrick)
                continue;
            const std::int32_t vertex =
                supportVertex(corners, d, start % corners.vertexCount(), method, &counters);
            const long double off = highest - exactHeight(corners.vertex(vertex));
            worstCornerUlps = std::max(worstCornerUlps, static_cast<double>(std::abs(off / ulp)));
        }
        cornerCount += corners.vertexCount() < hull.vertexCount();
    }

    void check(const Eigen::Matrix<S, 3, 1>& d, std::int32_t start)
    {
        const std::int32_t expected = scanPoints(points, d);
        checkCorners(d, start, expected);
        checkPeaks(d, start, expected);
        checkBoth(d, start);
        for (const SupportMethod method : kMethods)
        {
            const std::int32_t found = hull.sourceIndex(supportVertex(hull, d, start, method, &counters));
            if (found != expected)
            {
                ++wrongCount;
                ADD_FAILURE() << "method " << static_cast<int>(method) << " start " << start << " direction "
                              << d.transpose() << " found " << found << " expected " << expected;
            }
        }
        ++directionCount;
    }

    std::vector<Eigen::Matrix<S, 3, 1>> points;
    Hull<S> hull;
    SupportCounters counters;
    std::int64_t peakCount = 0, sureCount = 0;
    std::int64_t cornerCount = 0;  ///< directions searched on hulls with fewer vertices
    double worstCornerUlps = 0.0;  ///< of the radius times the direction's length
    int directionCount = 0;
    int wrongCount = 0;
};

/// Normals of faces and edges, directions between them, axes, and small perturbations of all of these.
template <class S>
std::vector<Eigen::Matrix<S, 3, 1>> specialDirections(const Hull<S>& hull, std::mt19937& engine,
                                                      std::size_t limit)
{
    std::vector<Eigen::Vector3d> exact;
    for (const auto& face : hull.faces())
        exact.push_back(face.normal);
    for (const auto& edge : hull.edges())
    {
        exact.push_back(hull.faces()[edge.left].normal + hull.faces()[edge.right].normal);
        exact.push_back((hull.vertex(edge.to) - hull.vertex(edge.from)).template cast<double>());
    }
    for (int axis = 0; axis < 3; ++axis)
        exact.push_back(Eigen::Vector3d::Unit(axis));
    std::shuffle(exact.begin(), exact.end() - 3, engine);
    std::vector<Eigen::Matrix<S, 3, 1>> directions;
    for (auto d = exact.rbegin(); d != exact.rend() && directions.size() < limit; ++d)
    {
        for (const double angle : {0.0, 1e-8, 1e-7, 1e-6, 1e-5, 1e-3})
        {
            const Eigen::Vector3d off = *d + angle * d->norm() * randomDirection(engine);
            directions.push_back(off.cast<S>());
            directions.push_back((-off).cast<S>());
        }
    }
    return directions;
}

/// @param randomCount directions for each shape, and `specialCount` directions where rounding decides; a tenth for
///                    large shapes
template <class S>
void compareOnAllShapes(int randomCount, std::size_t specialCount, std::int64_t leastDirections)
{
    std::int64_t directionCount = 0;
    std::int64_t tieCount = 0;
    std::int64_t searchCount = 0;
    std::int64_t peakCount = 0, sureCount = 0, cornerCount = 0;
    double worstCornerUlps = 0.0;
    for (const NamedPoints& shape : nastyShapes())
    {
        SCOPED_TRACE(shape.name);
        std::mt19937 engine(77);
        Comparison<S> comparison(shape.points);
        std::uniform_int_distribution<std::int32_t> anyVertex(0, comparison.hull.vertexCount() - 1);
        const int count = comparison.hull.vertexCount() > 300 ? randomCount / 10 : randomCount;
        for (int i = 0; i < count && comparison.wrongCount < 5; ++i)
        {
            const std::int32_t start = anyVertex(engine);
            comparison.check(randomDirection(engine).cast<S>(), start);
        }
        const std::size_t special = comparison.hull.vertexCount() > 300 ? specialCount / 10 : specialCount;
        for (const auto& d : specialDirections(comparison.hull, engine, special))
        {
            if (comparison.wrongCount < 5)
                comparison.check(d, anyVertex(engine));
        }
        EXPECT_EQ(comparison.wrongCount, 0);
        directionCount += comparison.directionCount;
        tieCount += comparison.counters.ties;
        searchCount += comparison.counters.searches;
        peakCount += comparison.peakCount;
        sureCount += comparison.sureCount;
        cornerCount += comparison.cornerCount;
        worstCornerUlps = std::max(worstCornerUlps, comparison.worstCornerUlps);
    }
    EXPECT_LE(worstCornerUlps, 1.0);
    EXPECT_GT(cornerCount, directionCount / 20);
    testing::Test::RecordProperty("worstCornerUlps", std::to_string(worstCornerUlps));
    EXPECT_GT(sureCount, peakCount / 4);
    EXPECT_LT(sureCount, peakCount * 9 / 10);
    testing::Test::RecordProperty("directions", std::to_string(directionCount));
    testing::Test::RecordProperty("searches", std::to_string(searchCount));
    // The sample has both climbs that end and ties that the scan decides.
    EXPECT_GT(tieCount, searchCount / (sizeof(S) == sizeof(float) ? 500 : 5000));
    EXPECT_LT(tieCount, searchCount / 2);
    EXPECT_GE(directionCount, leastDirections);
}
}  // namespace cullet::test
