// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Queries while the trees are updated, and after a failed allocation: they find the same as a scan of every box.

#include "cullet/broad/proxy_table.h"
#include "cullet/broad/queries/query_index.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/process/failing_new.h"
#include "cullet/tests/support/random.h"
#include "cullet/tests/support/threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>
#include <thread>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr std::uint32_t kSeed = 29;
constexpr std::uint32_t kRows = 400;
constexpr float kWorld = 30;

/// A table whose trees are up to date, and another change of it.
class ChangedTable
{
public:
    ChangedTable()
    {
        for (std::uint32_t i = 0; i < kRows; ++i)
            table.create(anyBox(), i + 1, kEverything);
        syncOnce();
    }

    Aabb anyBox()
    {
        const float x = random.between(0, kWorld);
        const float y = random.between(0, kWorld);
        return boxAt(x, y, random.between(0, kWorld));
    }

    void syncOnce()
    {
        index.forEachOverlap(anyBox(), [](ProxyId) {});
    }

    void moveAll()
    {
        for (ProxyId row = 0; row < kRows; ++row)
            table.setBox(row, anyBox());
    }

    /// Every row teleports, and new rows are created.
    void changeAll()
    {
        moveAll();
        for (std::uint32_t i = 0; i < kRows; ++i)
            table.create(anyBox(), kRows + i + 1, kEverything);
    }

    /// There are so many rows outside of the main tree that they get a second tree only once queries have tested them
    /// often.
    void changeFew()
    {
        for (ProxyId row = 0; row < 10; ++row)
        {
            table.setBox(row, anyBox());
            syncOnce();
        }
        table.setBox(10, anyBox());
        table.create(anyBox(), kRows + 1, kEverything);
    }

    ProxyTable table;
    QueryIndex index{table, {QueryMode::Tree, false}};
    Random random{kSeed};
};

/// Queries all over the world that allocate no memory.
class Questions
{
public:
    explicit Questions(ChangedTable& world) : m_isVisited(2 * kRows)
    {
        m_boxes.push_back(cube(-1, kWorld + 1));
        for (int i = 0; i < 40; ++i)
            m_boxes.push_back(translated(world.anyBox(), 1, 2, 3));
        for (ProxyId row = 0; row < 20; ++row)
            m_boxes.push_back(world.table.box(row));
        for (const Aabb& box : m_boxes)
        {
            for (ProxyId row = 0; row < world.table.size(); ++row)
                m_hits += overlaps(world.table.box(row), box) ? 1 : 0;
        }
    }

    /// Number of missed or duplicate rows in all answers.
    std::uint32_t countWrongAnswers(const ProxyTable& table, const QueryIndex& index)
    {
        std::uint32_t wrong = 0;
        for (const Aabb& box : m_boxes)
        {
            std::fill(m_isVisited.begin(), m_isVisited.end(), std::uint8_t{0});
            index.forEachOverlap(box, [&](ProxyId row) { wrong += m_isVisited[row]++; });
            for (ProxyId row = 0; row < table.size(); ++row)
                wrong += overlaps(table.box(row), box) && m_isVisited[row] == 0 ? 1 : 0;
        }
        return wrong;
    }

    std::uint64_t hits() const { return m_hits; }

private:
    std::vector<Aabb> m_boxes;
    std::vector<std::uint8_t> m_isVisited;
    std::uint64_t m_hits = 0;
};

struct Change
{
    const char* name;
    void (ChangedTable::*make)();
};

std::ostream& operator<<(std::ostream& out, const Change& change)
{
    return out << change.name;
}

class QueryIndexMemory : public testing::TestWithParam<Change>
{
};

TEST_P(QueryIndexMemory, MissesNoOverlapWhereverAllocationFails)
{
    bool hasFailed = true;
    std::uint64_t after = 0;
    for (; hasFailed; ++after)
    {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", allocation " + std::to_string(after));
        ChangedTable world;
        (world.*GetParam().make)();
        Questions questions(world);
        ASSERT_GT(questions.hits(), kRows);
        std::uint32_t wrong = 0;
        {
            const OneNewFails failure(after);
            wrong = questions.countWrongAnswers(world.table, world.index);
            hasFailed = failure.hasHappened();
        }
        ASSERT_EQ(wrong, 0u);
        ASSERT_EQ(questions.countWrongAnswers(world.table, world.index), 0u);
        world.table.setBox(3, world.anyBox());
        ASSERT_EQ(questions.countWrongAnswers(world.table, world.index), 0u);
    }
    EXPECT_GT(after, 3u) << "hardly anything was allocated";
}

INSTANTIATE_TEST_SUITE_P(Changes, QueryIndexMemory,
                         testing::Values(Change{"OfAllRows", &ChangedTable::changeAll},
                                         Change{"OfFewRows", &ChangedTable::changeFew}),
                         [](const auto& test) { return test.param.name; });

// This thread waits for the other query, so that query must not wait for the trees: their update has to be more
// expensive than a scan, as it is if all rows changed before the last query.
TEST(QueryIndexSync, MissesNoOverlapWhenOtherThreadQueriesWhileTreesChange)
{
    bool hasCalled = true;
    std::uint64_t after = 0;
    for (; hasCalled; ++after)
    {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", allocation " + std::to_string(after));
        ChangedTable world;
        world.moveAll();
        world.syncOnce();
        world.changeAll();
        Questions questions(world), others(world);
        std::uint32_t wrong = 0, wrongOfOther = 0;
        const std::function<void()> askElsewhere = [&]
        { onThreads(1, [&](int) { wrongOfOther = others.countWrongAnswers(world.table, world.index); }); };
        {
            const OneNewCalls call(after, askElsewhere);
            wrong = questions.countWrongAnswers(world.table, world.index);
            hasCalled = call.hasHappened();
        }
        ASSERT_EQ(wrong, 0u);
        ASSERT_EQ(wrongOfOther, 0u);
    }
    EXPECT_GT(after, 3u) << "hardly anything was allocated";
}

TEST(QueryIndexSync, LetsNoThreadReadTotalsWhileTreesChange)
{
    using Total = std::uint64_t (QueryIndex::*)() const;
    for (const Total total :
         {&QueryIndex::bytes, &QueryIndex::buildsTotal, &QueryIndex::syncsTotal, &QueryIndex::builtRowsTotal})
    {
        ChangedTable world;
        world.changeAll();
        std::atomic<bool> isRead{false};
        bool wasReadTooEarly = false;
        std::thread reader;
        // The first allocation of this query is one of the trees, under their lock.
        const std::function<void()> readElsewhere = [&]
        {
            reader = std::thread(
                [&]
                {
                    (world.index.*total)();
                    isRead = true;
                });
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
            wasReadTooEarly = isRead;
        };
        {
            const OneNewCalls call(0, readElsewhere);
            world.syncOnce();
            ASSERT_TRUE(call.hasHappened());
        }
        reader.join();
        EXPECT_FALSE(wasReadTooEarly);
    }
}
}  // namespace
}  // namespace cullet::test
