// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The cases of `cullet bench losses` that are about a broad phase, by counts of work: box tests, rebuilds, trees, bytes and
// allocations. A loss that comes back fails here without a clock.
#include "cullet/broad/row_source.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/support/random.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
BroadphaseOptions gridOptions(btScalar margin = btScalar(-1))
{
    BroadphaseOptions options;
    options.backend = BackendChoice::Grid;
    options.threads = 1;
    options.margin = margin;
    return options;
}

/// Cubes of a broad phase that count what its updates do.
class CountedCubes
{
public:
    explicit CountedCubes(const BroadphaseOptions& options = gridOptions()) : m_broadphase(options) {}
    explicit CountedCubes(std::unique_ptr<Backend> backend) : m_broadphase(std::move(backend)) {}

    void add(const btVector3& centre, double half = 0.5, int group = 1, int mask = kAllGroups,
             void* client = nullptr)
    {
        m_places.push_back(centre);
        m_halves.push_back(half);
        m_proxies.push_back(addCube(m_broadphase, centre, half, group, mask, client));
    }

    void place(std::size_t i, const btVector3& centre)
    {
        m_places[i] = centre;
        moveCube(m_broadphase, m_proxies[i], centre, m_halves[i]);
    }

    /// Each by up to `reach` on each axis.
    void walk(double reach, std::size_t first = 0)
    {
        for (std::size_t i = first; i < size(); ++i)
            place(i,
                  m_places[i] + vec(m_random.point(static_cast<float>(-reach), static_cast<float>(reach))));
    }

    void update()
    {
        m_broadphase.calculateOverlappingPairs(nullptr);
        const BackendStats stats = m_broadphase.stats().backend;
        m_tests += stats.candidates;
        m_mostTests = std::max(m_mostTests, stats.candidates);
    }

    void forgetTests() { m_tests = m_mostTests = 0; }
    std::uint64_t tests() const { return m_tests; }
    std::uint64_t mostTests() const { return m_mostTests; }
    std::uint64_t rebuilds() const { return m_broadphase.stats().backend.rebuildsTotal; }
    std::uint64_t bytes() const
    {
        const BroadphaseStats stats = m_broadphase.stats();
        return stats.bytes + stats.backend.bytes;
    }

    std::size_t size() const { return m_proxies.size(); }
    Broadphase& broadphase() { return m_broadphase; }
    Random& random() { return m_random; }

private:
    Random m_random{40};
    Broadphase m_broadphase;
    std::vector<btVector3> m_places;
    std::vector<double> m_halves;
    std::vector<btBroadphaseProxy*> m_proxies;
    std::uint64_t m_tests = 0, m_mostTests = 0;
};

TEST(LossCases, TestEachPairOfMaskedCrowdAtMostOnceAndKeepNone)
{
    constexpr std::uint64_t kBodies = 2000;
    // Lanes at the end of a list are counted, too, so that wide vectors count more.
    BroadphaseOptions options = gridOptions();
    options.grid.baselineSimd = true;
    CountedCubes cubes(options);
    for (std::uint64_t i = 0; i < kBodies; ++i)
        cubes.add(vec(cubes.random().point(-1, 1)), 0.5, 1, 2);
    cubes.update();
    cubes.forgetTests();
    for (int update = 0; update < 10; ++update)
    {
        cubes.walk(0.02);
        cubes.update();
    }
    EXPECT_LE(cubes.mostTests(), kBodies * kBodies * 11 / 20);
    EXPECT_LE(cubes.bytes(), 2 * kDbvtBytesPerBody * kBodies);
}

TEST(LossCases, TestPairsOfBodiesAtOneSpotTwiceUntilTheyHaveParted)
{
    constexpr std::uint64_t kBodies = 1000;
    CountedCubes cubes;
    for (std::uint64_t i = 0; i < kBodies; ++i)
        cubes.add(vec(0, 0, 0));
    cubes.update();
    constexpr std::uint64_t kPairs = kBodies * (kBodies - 1) / 2;
    ASSERT_EQ(cubes.broadphase().stats().pairs, kPairs);
    for (std::uint64_t i = 0; i < kBodies; ++i)
        cubes.place(i, vec(2.0 * double(i), 0, 0));
    cubes.update();
    ASSERT_EQ(cubes.broadphase().stats().pairs, 0u);
    EXPECT_LE(cubes.tests(), 9 * kPairs / 2);
    // Lists of pairs are freed by half and half.
    EXPECT_LE(cubes.bytes(), 48 * kPairs);
}

TEST(LossCases, KeepLittleOfListsOfPairsThatHaveParted)
{
    for (const std::uint64_t bodies : {60u, 300u, 900u})
    {
        SCOPED_TRACE(testing::Message() << bodies << " bodies");
        CountedCubes cubes, apart;
        for (std::uint64_t i = 0; i < bodies; ++i)
        {
            cubes.add(vec(0, 0, 0));
            apart.add(vec(2.0 * double(i), 0, 0));
        }
        // At one spot they also move a little, and rest.
        for (int update = 0; update < 8; ++update)
        {
            for (std::uint64_t i = 0; i < bodies; ++i)
                cubes.place(i, vec(1e-3 * update, 0, 0));
            cubes.update();
        }
        for (int update = 0; update < 6; ++update)
        {
            for (std::uint64_t i = 0; i < bodies; ++i)
            {
                const btVector3 place = vec(2.0 * double(i), 0, 0.3 * update);
                cubes.place(i, place);
                apart.place(i, place);
            }
            cubes.update();
            apart.update();
        }
        ASSERT_EQ(cubes.broadphase().stats().pairs, 0u);
        // A pair of ids has eight bytes: little of these is left.
        EXPECT_LE(cubes.bytes(), apart.bytes() + bodies * (bodies - 1) / 2 + 16384);
    }
}

TEST(LossCases, SortNoHeapAtRestAnewInItsFirstFrames)
{
    constexpr int kEdge = 25;
    CountedCubes cubes;
    for (int i = 0; i < kEdge * kEdge * kEdge; ++i)
        cubes.add(vec(0.99 * (i % kEdge), 0.99 * (i / kEdge % kEdge), 0.99 * (i / kEdge / kEdge)));
    cubes.update();
    const std::uint64_t atFirst = cubes.tests();
    cubes.forgetTests();
    const std::uint64_t rebuilds = cubes.rebuilds();
    for (int frame = 0; frame < 8; ++frame)
    {
        cubes.walk(0.0005);
        cubes.update();
    }
    EXPECT_LE(cubes.mostTests(), atFirst + atFirst / 2);
    EXPECT_LE(cubes.rebuilds() - rebuilds, 2u);
}

/// Static cubes among which ten links move: the loop of a motion planner.
class PlannersCubes : public CountedCubes
{
public:
    PlannersCubes() : CountedCubes(gridOptions(0))
    {
        for (std::size_t i = 0; i < kStatic + kLinks; ++i)
        {
            const bool isLink = i >= kStatic;
            const btVector3 centre = vec(random().point(-2, 2));
            add(centre, 0.1, isLink ? 2 : 1, isLink ? 3 : 2);
        }
        update();
    }
    static constexpr std::size_t kStatic = 1000, kLinks = 10;
    /// Rows, of which up to 64 are tested at a time.
    static constexpr std::uint64_t kTestedRows = 1024;
};

TEST(LossCases, CompareOnlyMovedLinksOfPlannerWithOthers)
{
    PlannersCubes cubes;
    constexpr std::uint64_t kMost = PlannersCubes::kLinks * PlannersCubes::kTestedRows;
    for (int check = 0; check < 120; ++check)
    {
        // The grid has found few changes by then.
        if (check == 20)
            cubes.forgetTests();
        cubes.walk(0.02, PlannersCubes::kStatic);
        cubes.update();
    }
    EXPECT_GT(cubes.tests(), 0u);
    EXPECT_LE(cubes.mostTests(), kMost);
    // Links that step are tested against all others only when their lists are made.
    EXPECT_LE(cubes.tests(), 100 * kMost / 8);
    cubes.forgetTests();
    for (int check = 0; check < 100; ++check)
    {
        for (std::size_t link = PlannersCubes::kStatic; link < cubes.size(); ++link)
            cubes.place(link, vec(cubes.random().point(-2, 2)));
        cubes.update();
    }
    EXPECT_LE(cubes.mostTests(), kMost);
    EXPECT_LE(cubes.rebuilds(), 2u);
    EXPECT_EQ(cubes.broadphase().stats().backend.levels, 0u) << "no grid";
    EXPECT_EQ(cubes.broadphase().stats().queryTreeBuildsTotal, 0u);
}

TEST(LossCases, ComparePlannersBoxesOnceAtStart)
{
    PlannersCubes cubes;
    EXPECT_LE(cubes.rebuilds(), 1u);
    EXPECT_LE(cubes.tests(), PlannersCubes::kTestedRows * PlannersCubes::kTestedRows / 4);
    EXPECT_LE(cubes.bytes(), 2 * kDbvtBytesPerBody * cubes.size());
}

TEST(LossCases, TestPairsOfFewBodiesOnceAtConstructionAndBuildNoTree)
{
    constexpr std::uint64_t kBodies = 100, kTestedRows = 128;
    CountedCubes cubes;
    for (std::uint64_t i = 0; i < kBodies; ++i)
        cubes.add(vec(cubes.random().point(0, 6)));
    cubes.update();
    EXPECT_GT(cubes.broadphase().stats().pairs, kBodies / 2);
    EXPECT_LE(cubes.tests(), kTestedRows * kTestedRows);
    EXPECT_EQ(cubes.rebuilds(), 0u);
    EXPECT_EQ(cubes.broadphase().stats().queryTreeBuildsTotal, 0u);
    EXPECT_LE(cubes.bytes(), 3 * kDbvtBytesPerBody * kBodies / 2);
}

TEST(LossCases, TestFewBoxesOfWallThatFallsApart)
{
    constexpr int kWidth = 40, kHeight = 25;
    CountedCubes cubes;
    for (int i = 0; i < kWidth * kHeight; ++i)
        cubes.add(vec(0.99 * (i % kWidth), 0.99 * (i / kWidth), 0));
    cubes.update();
    const std::uint64_t pairs = cubes.broadphase().stats().pairs;
    ASSERT_GT(pairs, 2u * kWidth * kHeight);
    cubes.forgetTests();
    for (int frame = 0; frame < 60; ++frame)
    {
        cubes.walk(0.05);
        cubes.update();
    }
    // The boxes of a wall are thin along one axis and full along two: some tests for each pair.
    EXPECT_LE(cubes.mostTests(), 12 * pairs);
    EXPECT_LE(cubes.rebuilds(), 3u);
    EXPECT_EQ(cubes.broadphase().stats().restartsTotal, 0u);
}

TEST(LossCases, TestEachBodyOfTinyWorldInOneStep)
{
    constexpr std::uint64_t kTestedAtOnce = 64;
    for (const std::uint64_t bodies : {2u, 4u, 14u})
    {
        CountedCubes cubes;
        for (std::uint64_t i = 0; i < bodies; ++i)
            cubes.add(vec(cubes.random().point(-1, 1)), 0.25);
        cubes.update();
        cubes.forgetTests();
        for (int update = 0; update < 100; ++update)
        {
            cubes.walk(0.05);
            cubes.update();
        }
        EXPECT_LE(cubes.mostTests(), bodies * kTestedAtOnce) << bodies;
        EXPECT_EQ(cubes.broadphase().stats().restartsTotal, 0u) << bodies;
        EXPECT_LE(cubes.bytes(), 24576u) << bodies;
    }
}

/// The grid, which counts what queries ask it.
class AskedGrid final : public Backend, public RowSource
{
public:
    struct Count
    {
        std::uint32_t queries = 0, answers = 0, cost = 0;
    };

    explicit AskedGrid(Count& count) : m_count(count), m_grid(makeGridBackend(oneThread())) {}

    Status update(const ProxyView& view, PairDelta& delta) override { return m_grid->update(view, delta); }
    void restart(const Pairs& known) override { m_grid->restart(known); }
    const char* name() const noexcept override { return m_grid->name(); }
    BackendStats stats() const override { return m_grid->stats(); }
    std::uint32_t findNearRay(const RayPath& ray, const Aabb* boxes, RowSink& sink) const override
    {
        return counted(dynamic_cast<const RowSource&>(*m_grid).findNearRay(ray, boxes, sink));
    }
    std::uint32_t findNearBox(const Aabb& box, const Aabb* boxes, RowSink& sink) const override
    {
        return counted(dynamic_cast<const RowSource&>(*m_grid).findNearBox(box, boxes, sink));
    }

private:
    static GridOptions oneThread()
    {
        GridOptions options;
        options.threads = 1;
        return options;
    }

    std::uint32_t counted(std::uint32_t cost) const
    {
        ++m_count.queries;
        m_count.answers += cost != 0 ? 1u : 0u;
        m_count.cost += cost;
        return cost;
    }

    Count& m_count;
    std::unique_ptr<Backend> m_grid;
};

enum class Question
{
    Ray,
    Sweep,
    Box
};

/// Asks a broad phase around the place; returns the number of hits.
std::size_t ask(Broadphase& broadphase, Question question, const btVector3& place)
{
    const btVector3 to = place + vec(20, 3, 1), half = vec(0.5, 0.5, 0.5);
    RayHits hits(place, to);
    if (question == Question::Box)
        broadphase.aabbTest(place - 2 * half, place + 2 * half, hits);
    else if (question == Question::Sweep)
        broadphase.rayTest(place, to, hits, -half, half);
    else
        broadphase.rayTest(place, to, hits);
    return hits.ids.size();
}

class LossOfQueries : public testing::TestWithParam<std::pair<Question, bool>>
{
};

INSTANTIATE_TEST_SUITE_P(All, LossOfQueries,
                         testing::Values(std::pair{Question::Ray, false}, std::pair{Question::Ray, true},
                                         std::pair{Question::Sweep, false}, std::pair{Question::Sweep, true},
                                         std::pair{Question::Box, false}, std::pair{Question::Box, true}));

TEST_P(LossOfQueries, AsksGridInsteadOfTreeOrScanForOneQueryInFrame)
{
    constexpr std::uint32_t kFrames = 20, kBodies = 20000;
    const auto [question, moves] = GetParam();
    AskedGrid::Count count;
    CountedCubes cubes(std::make_unique<AskedGrid>(count));
    for (std::uint32_t i = 0; i < kBodies; ++i)
        cubes.add(vec(cubes.random().point(0, 60)));
    std::size_t hits = 0;
    for (std::uint32_t frame = 0; frame < kFrames; ++frame)
    {
        if (moves)
            cubes.walk(0.05);
        cubes.update();
        hits += ask(cubes.broadphase(), question, vec(cubes.random().point(0, 60)));
    }
    EXPECT_GT(hits, 10u);
    EXPECT_EQ(count.answers, kFrames);
    EXPECT_LT(count.cost, kFrames * kBodies / 40);
    EXPECT_EQ(cubes.broadphase().stats().queryTreeBuildsTotal, 0u);
    EXPECT_EQ(cubes.broadphase().stats().queryTreeSyncsTotal, 0u);
}

TEST(LossCases, SearchGhostsThatWalkInFewOfTheirMovesAndSeldomBuildTheTree)
{
    constexpr std::uint64_t kCharacters = 400, kFrames = 20;
    btGhostPairCallback callback;
    std::vector<btPairCachingGhostObject> ghosts(kCharacters);
    CountedCubes cubes;
    cubes.broadphase().getOverlappingPairCache()->setInternalGhostPairCallback(&callback);
    for (std::uint64_t i = 0; i < kCharacters; ++i)
        cubes.add(vec(2.0 * double(i % 20), 0, 2.0 * double(i / 20)), 0.5, 1, kAllGroups, &ghosts[i]);
    cubes.update();
    const BroadphaseStats before = cubes.broadphase().stats();
    for (std::uint64_t frame = 0; frame < kFrames; ++frame)
    {
        cubes.walk(0.05);
        cubes.update();
    }
    const BroadphaseStats after = cubes.broadphase().stats();
    EXPECT_EQ(after.ghosts, kCharacters);
    EXPECT_LE(after.queryTreeBuildsTotal, kFrames / 4);
    EXPECT_LE(after.queryTreeSyncsTotal - before.queryTreeSyncsTotal, kFrames * kCharacters / 8);
    EXPECT_LE(cubes.mostTests(), kCharacters * kCharacters);
}
}  // namespace
}  // namespace cullet::test
