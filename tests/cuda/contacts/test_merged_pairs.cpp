// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Lists of pairs into which changes are merged on the CPU's executor, against a map.

#include "cullet/broad/host_device.h"
#include "cullet/cuda/contacts/merged_pairs.h"
#include "cullet/cuda/narrow/host_pair_exec.h"
#include "cullet/tests/cuda/support/host_contacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
using contacts::kVoidList;
using contacts::MergedPairs;
using convex::HostPairExec;
using Rows = std::pair<std::uint32_t, std::uint32_t>;

/// What is remembered of pairs, without hulls.
class Memories
{
public:
    void swapMemory() { std::swap(m_now, m_before); }
    convex::PairMemory memoryFor(HostPairExec& exec, std::uint32_t count)
    {
        exec.reserve(m_now.axes, count);
        exec.reserve(m_now.heights, count);
        exec.reserve(m_now.simplices, count);
        exec.reserve(m_now.states, count);
        return m_now.view();
    }
    convex::PairMemory otherMemory() const { return m_before.view(); }
    convex::PairMemory memory() const { return m_now.view(); }

private:
    struct Buffers
    {
        convex::PairMemory view() const
        {
            return {axes.data(), heights.data(), simplices.data(), states.data()};
        }

        HostPairExec::Buffer<PairAxis> axes;
        HostPairExec::Buffer<convex::PairHeights> heights;
        HostPairExec::Buffer<convex::PairSimplex> simplices;
        HostPairExec::Buffer<PairState> states;
    };

    Buffers m_now, m_before;
};

/// A list whose pairs remember their rows.
class MarkedList
{
public:
    MarkedList(PsapExecutor order, unsigned seed) : m_exec(contactOptions(order, seed)) {}

    /// Applies changes, in any order and either order of rows.
    void apply(std::vector<RowPair> added, std::vector<RowPair> removed, std::uint64_t rows)
    {
        const std::uint64_t before = m_held.size();
        for (const RowPair pair : removed)
            m_held.erase(sorted(pair));
        m_new.clear();
        for (const RowPair pair : added)
            m_new.insert(sorted(pair));
        m_held.insert(m_new.begin(), m_new.end());
        const DeltaCounts counts = {m_held.size() - added.size(), added.size(), removed.size()};
        const contacts::FoundChanges changes = {added.data(), added.size(), removed.data(), &counts, 0};
        m_list.prepare(m_exec, m_memories, before, rows);
        m_list.launch(m_exec, changes);
        EXPECT_EQ(m_list.isComplete(counts), *m_list.count() != kVoidList);
        if (!m_list.isComplete(counts))
        {
            ++repeats;
            m_list.prepareAgain(m_exec, m_memories, counts);
            m_list.launch(m_exec, changes);
        }
        EXPECT_TRUE(m_list.isComplete(counts));
        m_list.learn(counts, before == 0);
        check();
        mark();
    }

    const std::set<Rows>& held() const { return m_held; }

    int repeats = 0;

private:
    static Rows sorted(RowPair pair) { return std::minmax(pair.a, pair.b); }

    void check()
    {
        ASSERT_EQ(*m_list.count(), m_held.size());
        std::uint64_t place = 0;
        for (const Rows& rows : m_held)
        {
            const RowPair pair = m_list.pairs()[place];
            ASSERT_EQ(Rows(pair.a, pair.b), rows) << "place " << place;
            const convex::PairMemory memory = m_memories.memory();
            const bool isNew = m_new.count(rows) != 0;
            const Rows axis = {memory.axes[place].vertices, bitsOf(memory.axes[place].axis[1])};
            const Rows heights = {memory.heights[place].directionA, memory.heights[place].directionB};
            const Rows simplex = {memory.simplices[place].vertices[0], memory.simplices[place].vertices[3]};
            ASSERT_EQ(axis, isNew ? Rows(0, 0) : rows);
            ASSERT_EQ(heights, isNew ? Rows(0, 0) : rows);
            ASSERT_EQ(simplex, isNew ? Rows(0, 0) : rows);
            ASSERT_EQ(memory.states[place], isNew ? PairState::Apart : PairState::Overlapping);
            ++place;
        }
        for (; place < m_list.room(); ++place)
        {
            ASSERT_EQ(m_list.pairs()[place].a, kNoRow);
            ASSERT_EQ(m_memories.memory().states[place], PairState::Apart);
        }
    }

    /// Lets each pair remember its rows.
    void mark()
    {
        const convex::PairMemory memory = m_memories.memory();
        std::uint64_t place = 0;
        for (const Rows& rows : m_held)
        {
            std::memcpy(&memory.axes[place].axis[1], &rows.second, sizeof(rows.second));
            memory.axes[place].vertices = rows.first;
            memory.heights[place] = {rows.first, rows.second, 0.0f, rows.first};
            memory.simplices[place] = {{rows.first, 0, 0, rows.second}};
            memory.states[place++] = PairState::Overlapping;
        }
    }

    HostPairExec m_exec;
    Memories m_memories;
    MergedPairs<HostPairExec> m_list;
    std::set<Rows> m_held, m_new;
};

std::vector<RowPair> anyOf(const std::set<Rows>& pairs, double share, std::mt19937& engine)
{
    std::bernoulli_distribution isChosen(share), isTurned(0.5);
    std::vector<RowPair> chosen;
    for (const Rows& rows : pairs)
    {
        if (isChosen(engine))
            chosen.push_back(isTurned(engine) ? RowPair{rows.second, rows.first}
                                              : RowPair{rows.first, rows.second});
    }
    std::shuffle(chosen.begin(), chosen.end(), engine);
    return chosen;
}

/// Pairs that are not held, each once.
std::vector<RowPair> newPairs(const std::set<Rows>& held, std::size_t count, std::uint32_t rows,
                              std::mt19937& engine)
{
    std::set<Rows> chosen;
    while (chosen.size() < count)
    {
        const std::uint32_t a = engine() % rows, b = engine() % rows;
        if (a < b && held.count({a, b}) == 0)
            chosen.insert({a, b});
    }
    return anyOf(chosen, 1.0, engine);
}

class MergedPairLists : public testing::TestWithParam<PsapExecutor>
{
};

TEST_P(MergedPairLists, KeepWhatEachPairRemembersWhenOthersComeAndGo)
{
    const unsigned seed = 61;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 engine(seed);
    MarkedList list(GetParam(), seed);
    constexpr std::uint32_t kRows = 3000;
    std::size_t added = 0, removed = 0;
    // Many at first, then few, none, all, and many again.
    for (const int count : {20000, 300, 0, 40, 1, 9000, 0, 5, 30000, 10})
    {
        const double leaving = count == 9000 ? 1.0 : count == 0 ? 0.0 : 0.02;
        const std::vector<RowPair> leave = anyOf(list.held(), leaving, engine);
        const std::vector<RowPair> enter =
            newPairs(list.held(), static_cast<std::size_t>(count), kRows, engine);
        added += enter.size();
        removed += leave.size();
        list.apply(enter, leave, kRows);
        if (HasFatalFailure())
            return;
    }
    EXPECT_GT(added, 50000u);
    EXPECT_GT(removed, 10000u);
    EXPECT_GE(list.repeats, 3);
    EXPECT_LE(list.repeats, 6);
}

TEST_P(MergedPairLists, HoldAnyRowThereCanBe)
{
    MarkedList list(GetParam(), 62);
    constexpr std::uint32_t kLast = 0x7ffffffeu;
    list.apply({{kLast, 0}, {kLast - 1, kLast}, {0, 1}, {7, 3}}, {}, std::uint64_t{kLast} + 1);
    list.apply({{kLast - 1, 0}}, {{1, 0}, {0, kLast}}, std::uint64_t{kLast} + 1);
    list.apply({}, {{kLast, kLast - 1}}, 8);
    EXPECT_EQ(list.held(), (std::set<Rows>{{0, kLast - 1}, {3, 7}}));
    for (const std::uint32_t rows : {4u, 7u, 8u})
    {
        MarkedList few(GetParam(), 63);
        few.apply({{rows - 1, rows - 2}, {0, rows - 1}}, {}, rows);
        few.apply({{1, 2}}, {{0, rows - 1}}, rows);
    }
}

INSTANTIATE_TEST_SUITE_P(Host, MergedPairLists,
                         testing::Values(PsapExecutor::InOrder, PsapExecutor::Shuffled,
                                         PsapExecutor::Threads));

TEST(MergedPairRooms, AreRefusedBeyond31BitsOfRows)
{
    HostPairExec exec(contactOptions(PsapExecutor::InOrder, 1));
    Memories memories;
    MergedPairs<HostPairExec> list;
    EXPECT_THROW(list.prepare(exec, memories, 0, std::uint64_t{1} << 31), psap::ExecutorFailure);
    EXPECT_THROW(list.prepare(exec, memories, 0xfffffff0u, 10), psap::ExecutorFailure);
}
}  // namespace
}  // namespace cullet::test
