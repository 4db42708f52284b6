// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// resetPool(): a level is unloaded, and the next one begins with fewer bodies.

#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <gtest/gtest.h>

#include <vector>

namespace cullet::test
{
namespace
{
constexpr int kBodiesBefore = 1000;
constexpr int kSmall = 500;

/// Cubes in a line, each of which overlaps the next.
class Line
{
public:
    explicit Line(Broadphase& broadphase) : m_broadphase(broadphase) {}

    void add() { m_cubes.push_back(addCube(m_broadphase, placeOf(m_cubes.size()))); }

    void addUpTo(std::size_t count)
    {
        while (m_cubes.size() < count)
            add();
    }

    void shift(std::size_t index, double way)
    {
        moveCube(m_broadphase, m_cubes[index], placeOf(index) + vec(way, 0, 0));
    }

    /// The first cube jitters, so that the others count as resting.
    void rest(int updates)
    {
        for (int update = 0; update < updates; ++update)
        {
            shift(0, update % 2 * 0.001);
            m_broadphase.calculateOverlappingPairs(nullptr);
        }
    }

    void destroy()
    {
        for (btBroadphaseProxy* cube : m_cubes)
            m_broadphase.destroyProxy(cube, nullptr);
        m_cubes.clear();
    }

    std::size_t size() const { return m_cubes.size(); }

    int missingPairs()
    {
        int missing = 0;
        for (std::size_t i = 0; i + 1 < m_cubes.size(); ++i)
            missing += hasPair(m_broadphase, m_cubes[i], m_cubes[i + 1]) ? 0 : 1;
        return missing;
    }

private:
    static btVector3 placeOf(std::size_t index) { return vec(0.9 * static_cast<double>(index), 0, 0); }

    Broadphase& m_broadphase;
    std::vector<btBroadphaseProxy*> m_cubes;
};

TEST(BroadphaseReset, FindsAllPairsWhenASmallerLevelRestsAndGrows)
{
    Broadphase broadphase;
    Line line(broadphase);
    line.addUpTo(kBodiesBefore);
    line.rest(40);
    for (int update = 0; update < 3; ++update)
    {
        for (int i = kBodiesBefore - 2; i < kBodiesBefore; ++i)
            line.shift(static_cast<std::size_t>(i), 0.5 + 0.3 * update);
        broadphase.calculateOverlappingPairs(nullptr);
    }
    line.destroy();
    broadphase.resetPool(nullptr);

    line.addUpTo(kSmall);
    line.rest(40);
    while (line.size() < kBodiesBefore)
    {
        line.add();
        broadphase.calculateOverlappingPairs(nullptr);
        ASSERT_EQ(broadphase.getOverlappingPairCache()->getNumOverlappingPairs(),
                  static_cast<int>(line.size()) - 1);
    }
    EXPECT_EQ(line.missingPairs(), 0);
}

TEST(BroadphaseReset, UsesFlatArraysAgainWhenTheNextLevelIsSmall)
{
    Broadphase broadphase;
    Line line(broadphase);
    line.addUpTo(kBodiesBefore);
    broadphase.calculateOverlappingPairs(nullptr);
    const std::uint64_t rebuilds = broadphase.stats().backend.rebuildsTotal;
    ASSERT_GT(rebuilds, 0u);
    line.destroy();
    broadphase.resetPool(nullptr);

    line.addUpTo(50);
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(line.missingPairs(), 0);
    EXPECT_STREQ(broadphase.stats().backend.path, "flat restart");
    EXPECT_EQ(broadphase.stats().backend.rebuildsTotal, rebuilds) << "a total";
}

TEST(BroadphaseReset, KeepsTotalsOfQueries)
{
    Broadphase broadphase;
    Line line(broadphase);
    line.addUpTo(kBodiesBefore);
    broadphase.calculateOverlappingPairs(nullptr);
    for (int query = 0; query < 200; ++query)
        boxHits(broadphase, vec(0, 0, 0), vec(1, 1, 1));
    line.shift(0, 0.1);
    for (int query = 0; query < 200; ++query)
        boxHits(broadphase, vec(0, 0, 0), vec(1, 1, 1));
    const BroadphaseStats before = broadphase.stats();
    ASSERT_GT(before.queryTreeBuildsTotal, 0u);
    ASSERT_GT(before.queryTreeSyncsTotal, 0u);
    line.destroy();
    broadphase.resetPool(nullptr);
    EXPECT_EQ(broadphase.stats().queryTreeBuildsTotal, before.queryTreeBuildsTotal);
    EXPECT_EQ(broadphase.stats().queryTreeSyncsTotal, before.queryTreeSyncsTotal);
}
}  // namespace
}  // namespace cullet::test
