// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Backend::restart(): a backend replaces another one without losing a pair.

#include "cullet/tests/broad/conformance/backend_cases.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace cullet::test
{
namespace
{
class BackendRestart : public BackendTest
{
protected:
    /// Five boxes in a row, each touching the next: pairs 1-2, 2-3, 3-4, 4-5.
    BackendRestart()
    {
        for (int i = 0; i < 5; ++i)
            session.add(boxAt(static_cast<float>(i), 0, 0));
    }

    BackendSession session{GetParam().make()};
};

CULLET_ON_EVERY_BACKEND(BackendRestart);

TEST_P(BackendRestart, ReportsNothingWhenRestartedFromCorrectPairs)
{
    session.restart({{1, 2}, {2, 3}, {3, 4}, {4, 5}});
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
}

TEST_P(BackendRestart, ReportsAllPairsWhenRestartedFromNone)
{
    ASSERT_TRUE(session.step());
    session.restart({});
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 2}, {2, 3}, {3, 4}, {4, 5}}, {}));
}

TEST_P(BackendRestart, ReportsDifferenceWhenRestartedFromStalePairs)
{
    // 1-3 does not overlap, 7 and 9 never existed.
    session.restart({{1, 3}, {2, 3}, {4, 7}, {7, 9}});
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 2}, {3, 4}, {4, 5}}, {{1, 3}, {4, 7}, {7, 9}}));
}

TEST_P(BackendRestart, RemovesPairsOfProxyDestroyedBeforeRestart)
{
    ASSERT_TRUE(session.step());
    session.table.destroy(2);
    session.restart(session.pairs());
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {{2, 3}, {3, 4}}));
}

TEST_P(BackendRestart, ReadsRowsThatAreNotDirty)
{
    ASSERT_TRUE(session.step());
    session.changeBackend(GetParam().make());
    session.table.setBox(0, boxAt(10, 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {{1, 2}}));
    // A box that was clean when the second backend began now overlaps the moved box.
    session.table.setBox(0, boxAt(3.5f, 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 4}, {1, 5}}, {}));
}

TEST_P(BackendRestart, KeepsPairsWithinTheMarginAndPairsThatTheFilterNoLongerWants)
{
    session.margin = 0.25f;
    session.table.setBox(0, boxAt(-0.5f, 0, 0));
    session.table.setFilter(4, {1, 0});
    session.restart({{1, 2}, {4, 5}});
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{2, 3}, {3, 4}}, {}));
}

TEST_P(BackendRestart, MatchesOracleWhenRestartedWithinRandomWorld)
{
    BackendSession random{GetParam().make()};
    random.margin = 0.125f;
    RandomWorldOptions options;
    options.count = 60;
    RandomWorld world(11, options, random.table);
    for (int step = 0; step < 60; ++step)
    {
        SCOPED_TRACE("seed 11, step " + std::to_string(step));
        if (step % 7 == 3)
            random.restart(random.pairs());
        if (step % 11 == 5)
            random.changeBackend(GetParam().make());
        if (step % 17 == 9)
        {
            Pairs stale = random.pairs();
            if (stale.size() > 4)
                stale.erase(stale.begin(), stale.begin() + 4);
            random.restart(stale);
        }
        ASSERT_TRUE(random.step());
        world.step();
    }
    EXPECT_GT(random.addedTotal(), 100u);
    EXPECT_GT(random.removedTotal(), 100u);
}

/// The motion of the boxes of a TableLife in a step.
enum class Motion : std::uint32_t
{
    Rest,    ///< one box jitters
    Leave,   ///< ... and some boxes after the first half of the rows drift away
    Jitter,  ///< all boxes jitter
    Wander,
    Jump
};

/// A table whose proxies are destroyed together at times, and which is cleared and filled again: with fewer, as many
/// and more rows.
///
/// Boxes are of one size and loosely packed, so that most rest in the sense of every backend with a resting mode.
class TableLife
{
public:
    TableLife(BackendSession& session, std::uint32_t seed) : m_session(session), m_random(seed)
    {
        m_session.margin = 0.1f;
    }

    testing::AssertionResult grow(std::uint32_t count)
    {
        while (m_rows.size() < count)
            add();
        return m_session.step();
    }

    testing::AssertionResult growSlowly(std::uint32_t count)
    {
        testing::AssertionResult result = testing::AssertionSuccess();
        while (m_rows.size() < count && result)
            result = grow(std::min(static_cast<std::uint32_t>(m_rows.size()) + 4, count));
        return result;
    }

    testing::AssertionResult run(Motion motion, int steps)
    {
        testing::AssertionResult result = testing::AssertionSuccess();
        for (int step = 0; step < steps && result; ++step)
        {
            move(motion);
            result = m_session.step();
        }
        return result << "motion " << static_cast<std::uint32_t>(motion);
    }

    /// @param isSeen whether the backend is updated in between
    testing::AssertionResult clear(bool isSeen)
    {
        for (const ProxyId row : m_rows)
            m_session.table.destroy(row);
        m_rows.clear();
        testing::AssertionResult result = isSeen ? m_session.step() : testing::AssertionSuccess();
        const Pairs gone = m_session.pairs();
        m_session.table.clear();
        m_session.restart(gone);
        // Removed pairs are identified by ids that are not reused.
        m_nextId = gone.empty() ? 1 : m_nextId;
        return result;
    }

    Random& random() { return m_random; }

private:
    void add()
    {
        const float side = 4.0f;
        const float x = m_random.between(0, side);
        const float y = m_random.between(0, side);
        const Aabb box = boxAt(x, y, m_random.between(0, side), 0.4f);
        const Filter words = m_random.chance(0.1f) ? Filter{2, ~2} : kEverything;
        m_rows.push_back(m_session.addWithId(m_nextId++, box, words));
    }

    void shift(std::size_t index, float way)
    {
        const ProxyId row = m_rows[index];
        const float x = m_random.between(-way, way);
        const float y = m_random.between(-way, way);
        m_session.table.setBox(row, translated(m_session.table.box(row), x, y, m_random.between(-way, way)));
    }

    void move(Motion motion)
    {
        if (m_rows.empty())
            return;
        if (motion == Motion::Rest || motion == Motion::Leave)
            shift(0, 0.001f);
        for (std::size_t i = 0; i < 8 && motion == Motion::Leave; ++i)
            shift(std::min(m_rows.size() / 2 + 4 + i, m_rows.size() - 1), 0.5f);
        constexpr float kWays[] = {0, 0, 0.001f, 0.2f, 4};
        const float way = kWays[static_cast<std::uint32_t>(motion)];
        for (std::size_t i = 0; i < m_rows.size() && way > 0; ++i)
            shift(i, way);
    }

    BackendSession& m_session;
    Random m_random;
    std::vector<ProxyId> m_rows;
    std::uint32_t m_nextId = 1;
};

TEST_P(BackendRestart, KeepsAllPairsWhenASmallerTableRestsAndGrows)
{
    BackendSession world{GetParam().make()};
    TableLife table(world, 3);
    ASSERT_TRUE(table.grow(80));
    ASSERT_TRUE(table.run(Motion::Rest, 6));
    ASSERT_TRUE(table.run(Motion::Leave, 3));
    ASSERT_TRUE(table.clear(false));
    ASSERT_TRUE(table.grow(40));
    ASSERT_TRUE(table.run(Motion::Rest, 6));
    ASSERT_TRUE(table.growSlowly(100));
    ASSERT_TRUE(table.run(Motion::Rest, 6));
    ASSERT_TRUE(table.run(Motion::Leave, 3));
    EXPECT_GT(world.addedTotal(), 200u);
}

TEST_P(BackendRestart, KeepsAllPairsWhenTablesOfManySizesFollowOneAnother)
{
    constexpr std::uint32_t kSeed = 5;
    BackendSession world{GetParam().make()};
    TableLife table(world, kSeed);
    for (const std::uint32_t count : {90u, 40u, 0u, 110u, 1u, 52u})
    {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", " + std::to_string(count) + " rows");
        ASSERT_TRUE(table.grow(count / 2));
        ASSERT_TRUE(table.run(static_cast<Motion>(table.random().below(5)), 3));
        ASSERT_TRUE(table.grow(count));
        ASSERT_TRUE(table.run(static_cast<Motion>(table.random().below(5)), 5));
        ASSERT_TRUE(table.growSlowly(count + 8));
        ASSERT_TRUE(table.run(static_cast<Motion>(table.random().below(5)), 3));
        ASSERT_TRUE(table.clear(table.random().chance(0.5f)));
    }
    EXPECT_GT(world.addedTotal(), 500u);
    EXPECT_GT(world.removedTotal(), 500u);
}
}  // namespace
}  // namespace cullet::test
