// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "narrow/support.h"
#include "tests/narrow/shapes.h"

#include <gtest/gtest.h>

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

constexpr SupportMethod kMethods[] = {SupportMethod::Automatic, SupportMethod::Linear,
                                      SupportMethod::Climb,     SupportMethod::ClimbArtificial,
                                      SupportMethod::CubeMap,   SupportMethod::DobkinKirkpatrick};

template <class S>
struct Comparison
{
    Comparison(const Points& given)
        : points(castPoints<S>(given)), hull(makeHull(points, HullExtra::Hierarchy))
    {
    }

    /// Among some of the answer and its neighbours.
    void checkCandidates(const Eigen::Matrix<S, 3, 1>& d, std::int32_t start, std::int32_t expected)
    {
        if (!hull.hasNeighbours())
            return;
        const std::int32_t top = supportLinear(hull, d);
        const auto neighbours = hull.naturalNeighbours(top);
        const std::array<std::int32_t, 4> candidates = {start >= 0 ? start : neighbours[0], top,
                                                        neighbours[neighbours.size() / 2], neighbours[0]};
        const S band = hull.tieBand() * (std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]));
        for (int count = 1; count <= 4; ++count)
        {
            const std::int32_t found = supportAmong(hull, LaneDirection<S>(d), candidates, count, band);
            ++candidateCount;
            sureCount += found >= 0;
            if (found >= 0 && hull.sourceIndex(found) != expected)
            {
                ++wrongCount;
                ADD_FAILURE() << count << " candidates at " << top << " direction " << d.transpose()
                              << " found " << found << " expected " << expected;
            }
        }
    }

    void check(const Eigen::Matrix<S, 3, 1>& d, std::int32_t start)
    {
        const std::int32_t expected = scanPoints(points, d);
        checkCandidates(d, start, expected);
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
    std::int64_t candidateCount = 0, sureCount = 0;
    int directionCount = 0;
    int wrongCount = 0;
};

/// Normals of faces, of edges and of what lies between, axes, and all of these slightly off.
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

template <class S>
void compareOnAllShapes(int randomCount, std::size_t specialCount, std::int64_t leastDirections)
{
    std::int64_t directionCount = 0;
    std::int64_t tieCount = 0;
    std::int64_t searchCount = 0;
    std::int64_t candidateCount = 0, sureCount = 0;
    for (const NamedPoints& shape : nastyShapes())
    {
        SCOPED_TRACE(shape.name);
        std::mt19937 engine(77);
        Comparison<S> comparison(shape.points);
        std::uniform_int_distribution<std::int32_t> anyVertex(0, comparison.hull.vertexCount() - 1);
        const int count = comparison.hull.vertexCount() > 300 ? randomCount / 10 : randomCount;
        for (int i = 0; i < count && comparison.wrongCount < 5; ++i)
            comparison.check(randomDirection(engine).cast<S>(), anyVertex(engine));
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
        candidateCount += comparison.candidateCount;
        sureCount += comparison.sureCount;
    }
    EXPECT_GT(sureCount, candidateCount / 4);
    EXPECT_LT(sureCount, candidateCount * 9 / 10);
    testing::Test::RecordProperty("directions", std::to_string(directionCount));
    testing::Test::RecordProperty("searches", std::to_string(searchCount));
    // The sample has both: climbs that end by themselves and ties that the scan decides.
    EXPECT_GT(tieCount, searchCount / 500);
    EXPECT_LT(tieCount, searchCount / 2);
    EXPECT_GE(directionCount, leastDirections);
}

TEST(Support, AllMethodsFindTheScansVertexInFloat)
{
    compareOnAllShapes<float>(60000, 4000, 1000000);
}

TEST(Support, AllMethodsFindTheScansVertexInDouble)
{
    compareOnAllShapes<double>(6000, 2000, 100000);
}

TEST(Support, EveryStartVertexReachesTheSupportOfAxesOnAGridBox)
{
    // Here a climb without artificial neighbours and without the tie check stops in the middle of a face.
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

TEST(Support, ArtificialNeighboursLeadOffEveryPlateau)
{
    for (const NamedPoints& shape : nastyShapes())
    {
        SCOPED_TRACE(shape.name);
        // Rounded coordinates turn a plateau into slivers with steps below rounding; there the tie check is needed.
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

TEST(Support, CoherentClimbsTakeFewSteps)
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

TEST(Support, TheStartTableIsNearTheAnswer)
{
    const Hull<float> hull = hullOf<float>(icoPoints(3));
    std::mt19937 engine(7);
    SupportCounters counters;
    for (int i = 0; i < 10000; ++i)
        supportVertex<float>(hull, randomDirection(engine).cast<float>(), -1, SupportMethod::CubeMap,
                             &counters);
    EXPECT_LT(static_cast<double>(counters.steps) / static_cast<double>(counters.searches), 2.5);
}

TEST(Support, TheHierarchyLeadsToTheAnswerThroughLogarithmicallyManyLevels)
{
    for (const int subdivisions : {1, 2, 3, 4})
    {
        const Hull<double> hull = hullOf<double>(icoPoints(subdivisions), HullExtra::Hierarchy);
        SCOPED_TRACE(hull.vertexCount());
        const DkHierarchy& hierarchy = hull.hierarchy();
        EXPECT_LE(hierarchy.top().size(), 16u);
        EXPECT_LE(hierarchy.levelCount(), 5.0 * std::log2(hull.vertexCount() / 12.0));
        std::mt19937 engine(8);
        for (int i = 0; i < 2000; ++i)
        {
            const Eigen::Vector3d d = randomDirection(engine);
            ASSERT_EQ(hierarchyStart(hull, d), supportLinear(hull, d));
        }
    }
}

TEST(Support, EveryCornerIsOnTopOfTheHierarchyOrRemovedOnce)
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

TEST(Support, AHullWithoutAHierarchyIsSearchedAllTheSame)
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

TEST(Support, MeaninglessDirectionsEndWithAVertex)
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

TEST(Support, AStartOutsideOfTheHullIsIgnored)
{
    const Hull<float> hull = hullOf<float>(icoPoints(1));
    const Eigen::Vector3f d(0.3f, 0.2f, -0.7f);
    for (const SupportMethod method : kMethods)
        EXPECT_EQ(supportVertex<float>(hull, d, 4711, method), supportLinear(hull, d));
}
}  // namespace
}  // namespace cullet::test
