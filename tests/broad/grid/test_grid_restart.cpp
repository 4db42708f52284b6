// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The state of the column grid is reset for a new table: its pairs, and also its choices.

#include "cullet/broad/backend.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace cullet::test
{
namespace
{
constexpr float kCloudMargin = 0.04f;

std::unique_ptr<Backend> makeColumnGrid()
{
    GridOptions options;
    options.flatLimit = 0;
    options.threads = 1;
    return makeGridBackend(options);
}

/// Boxes of one size in a cube, all of which move a little in every step.
class Cloud
{
public:
    Cloud(std::uint32_t count, float side, float half)
    {
        for (std::uint32_t i = 0; i < count; ++i)
        {
            const float x = m_random.between(0, side);
            const float y = m_random.between(0, side);
            table.create(boxAt(x, y, m_random.between(0, side), half), i + 1, kEverything);
        }
    }

    void move(float way)
    {
        for (ProxyId row = 0; row < table.size(); ++row)
            table.setBox(row, translated(table.box(row), m_random.between(-way, way), 0, 0));
    }

    ProxyTable table;

private:
    Random m_random{3};
};

/// @return the path of the update, and its reason
std::string wayOfUpdate(Backend& backend, ProxyTable& table, PairDelta& delta)
{
    EXPECT_EQ(backend.update(table.beginUpdate(kCloudMargin, true), delta), Status::Ok);
    const BackendStats stats = backend.stats();
    return std::string(stats.path) + ": " + stats.decision.reason;
}

/// Runs a backend on a table, restarts it, and compares it with a new one on another table.
///
/// @param way motion of the boxes in each step
/// @return whether both entered the resting mode
bool expectToGoOnAsNew(Cloud& before, Cloud& after, float way)
{
    const std::unique_ptr<Backend> restarted = makeColumnGrid();
    const std::unique_ptr<Backend> fresh = makeColumnGrid();
    PairDelta delta, expected;
    for (int step = 0; step < 4; ++step, before.move(way))
    {
        wayOfUpdate(*restarted, before.table, delta);
        before.table.endUpdate();
    }
    restarted->restart({});
    bool haveSettled = false;
    for (int step = 0; step < 10; ++step, after.move(0.25f * kCloudMargin))
    {
        SCOPED_TRACE("step " + std::to_string(step));
        const std::string path = wayOfUpdate(*fresh, after.table, expected);
        EXPECT_EQ(wayOfUpdate(*restarted, after.table, delta), path);
        EXPECT_EQ(delta.added, expected.added);
        EXPECT_EQ(delta.removed, expected.removed);
        EXPECT_LE(restarted->stats().entries, 2 * fresh->stats().entries);
        haveSettled = haveSettled || path.rfind("settle", 0) == 0;
        after.table.endUpdate();
    }
    return haveSettled;
}

TEST(GridRestart, MatchesNewGridWhenNextTableIsSmaller)
{
    Cloud before(600, 8, 0.4f);
    Cloud after(40, 4, 0.4f);
    EXPECT_TRUE(expectToGoOnAsNew(before, after, 0.25f * kCloudMargin));
}

TEST(GridRestart, MatchesNewGridWhenTableIsTheSame)
{
    Cloud cloud(200, 6, 0.4f);
    EXPECT_TRUE(expectToGoOnAsNew(cloud, cloud, 0.25f * kCloudMargin));
}

TEST(GridRestart, MatchesNewGridWhenBoxesWereFastBefore)
{
    Cloud before(400, 100, 8);
    Cloud after(200, 1, 0.02f);
    EXPECT_TRUE(expectToGoOnAsNew(before, after, 1.0f));
}
}  // namespace
}  // namespace cullet::test
