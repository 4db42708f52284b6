// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/narrow/support/support_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
TEST(Support, FindsVertexOfScanWithAllMethodsInFloat)
{
    compareOnAllShapes<float>(60000, 4000, 1000000);
}

TEST(Support, FindsVertexOfScanWithAllMethodsInDouble)
{
    compareOnAllShapes<double>(6000, 2000, 100000);
}

/// A hull of points on a coarse grid, so that many are level.
template <class S>
Hull<S> smallHull(int count, std::mt19937& engine)
{
    std::uniform_int_distribution<int> place(-4, 4);
    std::vector<Eigen::Matrix<S, 3, 1>> points;
    for (int i = 0; i < count; ++i)
        points.push_back(drawVector(place, engine).cast<S>());
    return makeHull(points);
}

template <class S>
void compareFew()
{
    std::mt19937 engine(11);
    // Few values, so that products are often equal.
    std::uniform_int_distribution<int> component(-3, 3);
    std::array<int, kFewVertices + 1> hulls = {};
    int ties = 0;
    for (int round = 0; round < 3000; ++round)
    {
        const Hull<S> hull = smallHull<S>(1 + round % 30, engine);
        if (hull.vertexCount() > kFewVertices)
            continue;
        ++hulls[static_cast<std::size_t>(hull.vertexCount())];
        for (int k = 0; k < 20; ++k)
        {
            const Eigen::Matrix<S, 3, 1> d = drawVector(component, engine).cast<S>();
            const LaneDirection<S> lanes(d);
            const std::int32_t expected = supportLinear(hull, d);
            const SupportHit<S> hit = hitFew(hull, lanes);
            ASSERT_EQ(hit.vertex, expected) << "seed 11, round " << round;
            ASSERT_EQ(hit.height, supportProduct(hull, expected, d));
            ASSERT_EQ(largestProduct(hull, lanes), hit.height);
            for (std::int32_t v = expected + 1; v < hull.vertexCount(); ++v)
                ties += supportProduct(hull, v, d) == hit.height ? 1 : 0;
        }
    }
    EXPECT_GT(ties, 1000);
    for (int count : {1, 2, 4, 8, 9, 12})
        EXPECT_GT(hulls[static_cast<std::size_t>(count)], 10) << count;
    const Hull<S> box = hullOf<S>(boxPoints(1.0, 1.0, 1.0));
    const S nan = std::numeric_limits<S>::quiet_NaN();
    const SupportHit<S> lost = hitFew(box, LaneDirection<S>(Eigen::Matrix<S, 3, 1>(nan, S(1), S(0))));
    EXPECT_GE(lost.vertex, 0);
    EXPECT_LT(lost.vertex, 8);
}

TEST(Support, FindsVertexOfScanAmongFewVertices)
{
    compareFew<float>();
    compareFew<double>();
}

TEST(Support, ReachesAxisSupportOfGridBoxFromEveryStartVertex)
{
    // On this hull a climb without artificial neighbours and without the tie check stops in the middle of a face.
    Comparison<float> comparison(gridBoxPoints(5));
    int stuckCount = 0;
    for (int axis = 0; axis < 6; ++axis)
    {
        const Eigen::Vector3f d = (axis % 2 == 0 ? 1.0f : -1.0f) * Eigen::Vector3f::Unit(axis / 2);
        for (std::int32_t start = 0; start < comparison.hull.vertexCount(); ++start)
        {
            comparison.check(d, start);
            bool isStuck = supportProduct(comparison.hull, start, d) < 0.5f;
            for (const std::int32_t u : comparison.hull.naturalNeighbours(start))
                isStuck = isStuck &&
                          supportProduct(comparison.hull, u, d) <= supportProduct(comparison.hull, start, d);
            stuckCount += isStuck;
        }
    }
    EXPECT_GT(stuckCount, 20);
}

TEST(Support, ClimbsOffEveryPlateauByArtificialNeighbours)
{
    for (const NamedPoints& shape : nastyShapes())
    {
        SCOPED_TRACE(shape.name);
        // Rounded coordinates turn a plateau into slivers with steps below rounding, which require the tie check.
        const bool isRounded =
            shape.name.find("turned") != std::string::npos || shape.name.find("far") != std::string::npos;
        if (isRounded)
            continue;
        const Hull<double> hull = hullOf<double>(shape.points);
        std::mt19937 engine(4);
        std::int64_t count = 0;
        for (const auto& d : specialDirections(hull, engine, 300))
        {
            // The pure climb, without the scan that decides ties.
            std::int32_t vertex =
                static_cast<std::int32_t>(engine() % static_cast<unsigned>(hull.vertexCount()));
            for (;;)
            {
                const ClimbStep<double> step = climbStep(hull, vertex, LaneDirection<double>(d));
                if (!(step.bestHeight > step.height))
                    break;
                vertex = step.best;
            }
            const double deficit =
                supportProduct(hull, supportLinear(hull, d), d) - supportProduct(hull, vertex, d);
            EXPECT_LE(deficit, 1e-12 * d.norm() * hull.radius());
            ++count;
        }
        EXPECT_GE(count, 100);
    }
}

TEST(Support, TakesFewStepsInCoherentClimbs)
{
    const Hull<float> hull = hullOf<float>(icoPoints(3));
    std::mt19937 engine(6);
    SupportCounters counters;
    Eigen::Vector3d d = randomDirection(engine);
    std::int32_t vertex = -1;
    for (int i = 0; i < 10000; ++i)
    {
        vertex =
            supportVertex<float>(hull, d.cast<float>(), vertex, SupportMethod::ClimbArtificial, &counters);
        d = (d + 0.03 * randomDirection(engine)).normalized();
    }
    EXPECT_LT(static_cast<double>(counters.steps) / static_cast<double>(counters.searches), 1.6);
}

TEST(Support, StartsNearAnswerWithStartTable)
{
    const Hull<float> hull = hullOf<float>(icoPoints(3));
    std::mt19937 engine(7);
    SupportCounters counters;
    int hitCount = 0;
    for (int i = 0; i < 10000; ++i)
    {
        const Eigen::Vector3f d = randomDirection(engine).cast<float>();
        const std::int32_t vertex = supportVertex<float>(hull, d, -1, SupportMethod::CubeMap, &counters);
        hitCount += cubeMapStart(hull, d) == vertex;
    }
    EXPECT_LT(static_cast<double>(counters.steps) / static_cast<double>(counters.searches), 2.5);
    RecordProperty("hits", hitCount);
    EXPECT_GT(hitCount, 4000);
}

/// Vertices that a descent through the hierarchy compares.
std::int64_t verticesSeen(const Hull<double>& hull, const Eigen::Vector3d& d)
{
    const DkHierarchy& hierarchy = hull.hierarchy();
    const auto isLower = [&](std::int32_t l, std::int32_t r)
    { return supportProduct(hull, l, d) < supportProduct(hull, r, d); };
    std::int32_t best = *std::max_element(hierarchy.top().begin(), hierarchy.top().end(), isLower);
    std::size_t seen = hierarchy.top().size();
    for (std::int32_t level = hierarchy.levelCount() - 1; level >= 0; --level)
    {
        const auto& removed = hierarchy.removed(level, best);
        for (const std::int32_t v : removed)
        {
            best = isLower(best, v) ? v : best;
            ++seen;
        }
    }
    return static_cast<std::int64_t>(seen);
}

TEST(Support, FindsVertexThroughLogarithmicallyManyHierarchyLevels)
{
    for (const int subdivisions : {1, 2, 3, 4, 5})
    {
        const Hull<double> hull = hullOf<double>(icoPoints(subdivisions), HullExtra::Hierarchy);
        SCOPED_TRACE(hull.vertexCount());
        const DkHierarchy& hierarchy = hull.hierarchy();
        EXPECT_LE(hierarchy.top().size(), 16u);
        EXPECT_LE(hierarchy.levelCount(), 5.0 * std::log2(hull.vertexCount() / 12.0));
        std::mt19937 engine(8);
        const int count = hull.vertexCount() > 10000 ? 200 : 2000;
        std::int64_t seen = 0;
        for (int i = 0; i < count; ++i)
        {
            const Eigen::Vector3d d = randomDirection(engine);
            ASSERT_EQ(hierarchyStart(hull, d), supportLinear(hull, d));
            seen += verticesSeen(hull, d);
        }
        EXPECT_LE(static_cast<double>(seen) / count, 5.0 * std::log2(hull.vertexCount()));
    }
}

TEST(Support, KeepsEveryCornerInHierarchyTopOrRemovesItOnce)
{
    for (const NamedPoints& shape : nastyShapes())
    {
        SCOPED_TRACE(shape.name);
        const Hull<float> hull = hullOf<float>(shape.points, HullExtra::Hierarchy);
        const DkHierarchy& hierarchy = hull.hierarchy();
        ASSERT_TRUE(hierarchy.isBuilt());
        std::vector<int> levels(static_cast<std::size_t>(hull.vertexCount()), -1);
        std::vector<std::int32_t> finer = hierarchy.top();
        for (const std::int32_t v : finer)
            levels[v] = hierarchy.levelCount();
        for (std::int32_t level = hierarchy.levelCount() - 1; level >= 0; --level)
        {
            const std::vector<std::int32_t> coarser = finer;
            for (const std::int32_t v : coarser)
            {
                for (const std::int32_t u : hierarchy.removed(level, v))
                {
                    ASSERT_TRUE(levels[u] == -1 || levels[u] == level);
                    if (levels[u] == -1)
                        finer.push_back(u);
                    levels[u] = level;
                }
            }
            EXPECT_GT(finer.size(), coarser.size());
        }
        for (std::int32_t v = 0; v < hull.vertexCount(); ++v)
            EXPECT_TRUE(levels[v] >= 0 || hull.facesOf(v).size() == 0);
    }
}

TEST(Support, FindsVertexWhenHullHasNoHierarchy)
{
    const Hull<float> hull = hullOf<float>(icoPoints(2));
    ASSERT_FALSE(hull.hierarchy().isBuilt());
    std::mt19937 engine(10);
    for (int i = 0; i < 1000; ++i)
    {
        const Eigen::Vector3f d = randomDirection(engine).cast<float>();
        ASSERT_EQ(supportVertex<float>(hull, d, -1, SupportMethod::DobkinKirkpatrick),
                  supportLinear(hull, d));
    }
}

TEST(Support, ReturnsVertexForMeaninglessDirections)
{
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const NamedPoints& shape : queryShapes())
    {
        SCOPED_TRACE(shape.name);
        const Hull<float> hull = hullOf<float>(shape.points, HullExtra::Hierarchy);
        for (const SupportMethod method : kMethods)
        {
            EXPECT_EQ(supportVertex<float>(hull, Eigen::Vector3f::Zero(), 3, method), 0);
            for (const Eigen::Vector3f& d : {Eigen::Vector3f(nan, 0, 0), Eigen::Vector3f(1, nan, nan)})
            {
                const std::int32_t vertex = supportVertex<float>(hull, d, 3, method);
                EXPECT_GE(vertex, 0);
                EXPECT_LT(vertex, hull.vertexCount());
            }
        }
    }
}

TEST(Support, SearchesAsAskedWhenScanWouldBeCheaper)
{
    const Hull<float> box = hullOf<float>(boxPoints(0.7, 0.5, 0.6), HullExtra::Hierarchy);
    for (const SupportMethod method : kMethods)
    {
        SupportCounters counters;
        supportVertex<float>(box, {1, 2, 3}, -1, method, &counters);
        const bool isScan = method == SupportMethod::Automatic || method == SupportMethod::Linear;
        EXPECT_EQ(counters.searches, 1);
        EXPECT_EQ(counters.steps > 0, !isScan) << static_cast<int>(method);
    }
}

TEST(Support, CountsClimbsThatEndLevel)
{
    const Hull<float> box = hullOf<float>(boxPoints(0.7, 0.5, 0.6));
    for (const SupportMethod method :
         {SupportMethod::Climb, SupportMethod::ClimbArtificial, SupportMethod::CubeMap})
    {
        SupportCounters counters;
        supportVertex<float>(box, {1, 2, 3}, 0, method, &counters);
        EXPECT_EQ(counters.ties, 0) << static_cast<int>(method);
        supportVertex<float>(box, {0, 0, 1}, 0, method, &counters);
        EXPECT_EQ(counters.ties, 1) << static_cast<int>(method);
        supportVertex<float>(box, {0, -1, 0}, 0, method, &counters);
        EXPECT_EQ(counters.ties, 2) << static_cast<int>(method);
    }
}

/// A prism along an axis of the world, turned by so little that its ends are level up to rounding.
Points nearlyUpright(int axis, std::mt19937& engine)
{
    std::uniform_real_distribution<double> tilt(-1e-4, 1e-4);
    const Eigen::Vector3d turn = drawVector(tilt, engine);
    Points points = prismPoints(40, 0.5);
    for (Eigen::Vector3d& p : points)
    {
        std::rotate(p.data(), p.data() + 2 - axis, p.data() + 3);
        p += turn.cross(p);
    }
    return points;
}

template <class S>
void checkNearlyUpright(int axis, std::mt19937& engine)
{
    const Hull<S> hull = hullOf<S>(nearlyUpright(axis, engine));
    int level = 0;
    for (const auto& face : hull.faces())
    {
        if (std::abs(face.normal[axis]) < 0.9)
            continue;
        const Eigen::Matrix<S, 3, 1> d = face.normal.template cast<S>();
        const std::int32_t top = supportLinear(hull, d);
        for (std::int32_t start = 0; start < hull.vertexCount(); ++start)
        {
            SupportCounters counters;
            for (const SupportMethod method : {SupportMethod::Climb, SupportMethod::ClimbArtificial})
                ASSERT_EQ(supportVertex(hull, d, start, method, &counters), top);
            level += counters.ties > 0;
        }
    }
    EXPECT_GT(level, 80);
}

TEST(Support, ClimbsToVertexOfScanWhenFaceIsNearlyAcrossAxis)
{
    constexpr unsigned kSeed = 8;
    std::mt19937 engine(kSeed);
    for (int round = 0; round < 60; ++round)
    {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", round " + std::to_string(round));
        checkNearlyUpright<float>(round % 3, engine);
        checkNearlyUpright<double>(round % 3, engine);
    }
}

TEST(Support, IgnoresStartVertexOutsideHull)
{
    const Hull<float> hull = hullOf<float>(icoPoints(1));
    const Eigen::Vector3f d(0.3f, 0.2f, -0.7f);
    for (const SupportMethod method : kMethods)
        EXPECT_EQ(supportVertex<float>(hull, d, 4711, method), supportLinear(hull, d));
}
}  // namespace
}  // namespace cullet::test
