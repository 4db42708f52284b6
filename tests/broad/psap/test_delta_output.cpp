// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The changes of an update by unique ids: in order with every sorting method.

#include "cullet/broad/psap/update/delta_output.h"
#include "cullet/broad/psap/update/update_buffers.h"
#include "cullet/cuda/host/host_exec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <random>
#include <set>
#include <stdexcept>
#include <vector>

namespace cullet::test
{
namespace
{
using psap::ChangeLists;
using psap::Counters;
using psap::DeltaOutput;
using psap::LookupTable;
using psap::OrderBucket;
using psap::RankChange;
using psap::UpdateCounters;

/// HostExec that counts its sorts and transfers, and can fail.
class WatchedExec : public psap::HostExec
{
public:
    using HostExec::HostExec;

    void sortKeys(const std::uint64_t* keys, std::uint64_t* sorted, std::uint64_t count, int bits)
    {
        ++sorts;
        HostExec::sortKeys(keys, sorted, count, bits);
    }
    template <class T>
    void exclusiveSum(const T* in, T* out, std::uint64_t count)
    {
        ++scans;
        if (failsInSum)
            throw std::runtime_error("of the test");
        HostExec::exclusiveSum(in, out, count);
    }
    using HostExec::mappedForWriting;
    Pair* mappedForWriting(Pair* list, std::uint64_t count)
    {
        ++lists;
        written.insert(list);
        return HostExec::mappedForWriting(list, count);
    }
    template <class T>
    bool canAccessDirectly(const T*, std::uint64_t) const
    {
        return canLock;
    }

    int sorts = 0;
    int scans = 0;
    int lists = 0;                  ///< lists of changes written
    std::set<const Pair*> written;  ///< their addresses
    bool canLock = true;
    bool failsInSum = false;
};

/// Rows with unique ids in a different order.
class DeltaOutputs : public ::testing::Test
{
protected:
    explicit DeltaOutputs(std::uint32_t rows = 20000, std::uint32_t firstId = 1,
                          std::uint64_t expected = 17000)
        : m_ids(rows), m_output(expected)
    {
        std::iota(m_ids.begin(), m_ids.end(), firstId);
        std::shuffle(m_ids.begin(), m_ids.end(), m_random);
    }

    /// `count` different pairs of neighbouring rows.
    std::vector<RowPair> chain(std::uint32_t count, std::uint32_t distance = 1) const
    {
        std::vector<RowPair> pairs(count);
        for (std::uint32_t i = 0; i < count; ++i)
            pairs[i] = {i, i + distance};
        return pairs;
    }

    /// Pairs of the row with the least id and other rows.
    std::vector<RowPair> star(std::uint32_t count) const
    {
        const auto least =
            static_cast<std::uint32_t>(std::min_element(m_ids.begin(), m_ids.end()) - m_ids.begin());
        std::vector<RowPair> pairs;
        for (std::uint32_t row = 0; pairs.size() < count; ++row)
        {
            if (row != least)
                pairs.push_back({row, least});
        }
        return pairs;
    }

    /// @param room capacity of the list of held pairs
    void expectNamed(const std::vector<RowPair>& added, const std::vector<RowPair>& removed,
                     std::uint64_t room = 100000)
    {
        Update update(*this, added, removed, room);
        m_output.enqueue(m_exec, update.lists, largestId(), m_delta);
        EXPECT_EQ(m_output.counters().lists.added, added.size());
        EXPECT_EQ(m_output.counters().unboundedCount, update.sides);
        EXPECT_EQ(update.next.counters.lists.removed + update.next.motion, 0u);
        m_output.take(m_exec, update.lists, largestId(), false, m_delta);
        EXPECT_EQ(m_delta.added, named(added));
        EXPECT_EQ(m_delta.removed, named(removed));
        EXPECT_EQ(update.slots, std::vector<std::uint64_t>(64, LookupTable::kFree));
        // The first held pair was there before. Beyond the room is memory of somebody else.
        for (std::size_t i = 0; i < update.held.size(); ++i)
        {
            const bool isAdded = i >= 1 && i - 1 < added.size() && i < room;
            const RowPair expected = isAdded ? added[i - 1] : Update::kUntouched;
            ASSERT_TRUE(update.held[i].a == expected.a && update.held[i].b == expected.b) << i;
            ASSERT_EQ(update.depths[i], isAdded ? 0.0f : 7.0f) << i;
        }
    }

    /// An update that ends in the middle: its changes are counted in the buckets, and not yet taken out.
    void failWithBuckets(const std::vector<RowPair>& added, const std::vector<RowPair>& removed)
    {
        Update update(*this, added, removed, 100000);
        m_exec.failsInSum = true;
        EXPECT_THROW(m_output.enqueue(m_exec, update.lists, largestId(), m_delta), std::runtime_error);
        m_exec.failsInSum = false;
        EXPECT_EQ(m_exec.scans, 1) << "the changes are ordered without buckets";
    }

    /// How often the last call transferred both lists of changes.
    int askings() const { return m_exec.lists / 2; }

    /// Later calls use new lists of changes.
    void takeOtherLists() { m_delta = {}; }
    void lockNoLists() { m_exec.canLock = false; }
    const Pair* addedList() const { return m_delta.added.data(); }
    /// Whether the last call wrote both lists where the caller reads them, instead of elsewhere for a copy.
    bool wroteInPlace() const
    {
        const std::set<const Pair*> lists = {m_delta.added.data(), m_delta.removed.data()};
        return lists == m_exec.written;
    }

    /// Whether the last call sorted the changes by buckets alone.
    bool wentByBuckets() const { return m_exec.sorts == 0 && m_exec.scans > 0; }
    /// Whether the last call sorted by comparing all changes with each other.
    bool wereRanked() const { return m_exec.sorts == 0 && m_exec.scans == 0; }

    void recover() { m_output.recover(); }

    std::uint32_t lesserId(RowPair pair) const { return std::min(m_ids[pair.a], m_ids[pair.b]); }

private:
    /// The lists of one update.
    struct Update
    {
        static constexpr RowPair kUntouched = {0xfffffff0u, 0xfffffff1u};

        Update(DeltaOutputs& test, const std::vector<RowPair>& added, const std::vector<RowPair>& removed,
               std::uint64_t room)
            : held(std::max<std::uint64_t>(room, added.size()) + 2, kUntouched), depths(held.size(), 7.0f)
        {
            counters.lists.added = added.size();
            counters.lists.removed = removed.size();
            counters.lists.kept = 1;
            next.counters.lists.removed = next.motion = 3;
            lists = {added.data(),
                     added.size(),
                     removed.data(),
                     held.data(),
                     depths.data(),
                     room,
                     LookupTable{slots.data(), slots.size() - 1, &counters.lists.lookups},
                     &counters,
                     &sides,
                     test.m_ids.data(),
                     &next};
            test.m_exec.sorts = test.m_exec.scans = test.m_exec.lists = 0;
            test.m_exec.written.clear();
        }
        Update(const Update&) = delete;
        Update& operator=(const Update&) = delete;

        Counters counters{};
        const std::uint32_t sides = 77;
        std::vector<std::uint64_t> slots = std::vector<std::uint64_t>(64, 5);
        UpdateCounters next{};
        std::vector<RowPair> held;  ///< with room for all pairs that enter, whatever the lists say
        std::vector<float> depths;
        ChangeLists lists{};
    };

    std::uint32_t largestId() const { return *std::max_element(m_ids.begin(), m_ids.end()); }

    Pairs named(const std::vector<RowPair>& pairs) const
    {
        Pairs names;
        for (const RowPair& pair : pairs)
            names.push_back({lesserId(pair), std::max(m_ids[pair.a], m_ids[pair.b])});
        std::sort(names.begin(), names.end());
        return names;
    }

    std::mt19937 m_random{7};
    std::vector<std::uint32_t> m_ids;
    WatchedExec m_exec{PsapOptions{}};
    PairDelta m_delta;
    DeltaOutput<WatchedExec> m_output;
};

/// Fixture in which few changes are expected.
class SmallDeltaOutputs : public DeltaOutputs
{
protected:
    SmallDeltaOutputs() : DeltaOutputs(20000, 1, 600) {}
};

/// Fixture with ids that need all bits of a key.
class LargeIdDeltaOutputs : public DeltaOutputs
{
protected:
    LargeIdDeltaOutputs() : DeltaOutputs(20000, 0xffff0000u, 17000) {}
};
}  // namespace

TEST_F(DeltaOutputs, OrderManyChangesByBucketsWithoutSort)
{
    for (int update = 0; update < 3; ++update)
    {
        expectNamed(chain(9000), chain(8000, 2));
        EXPECT_TRUE(wentByBuckets());
        EXPECT_EQ(askings(), 1);
    }
    expectNamed(chain(9000), {});
    EXPECT_TRUE(wentByBuckets());
    expectNamed({}, chain(9000, 3));
    EXPECT_TRUE(wentByBuckets());
    expectNamed({}, {});
    EXPECT_TRUE(wentByBuckets());
}

TEST_F(SmallDeltaOutputs, RankFewChangesInsteadOfSorting)
{
    expectNamed(chain(100), chain(50, 2));
    EXPECT_TRUE(wereRanked());
    expectNamed({}, {});
    EXPECT_TRUE(wereRanked());
    expectNamed(star(600), {});
    EXPECT_TRUE(wereRanked());
    expectNamed({}, star(599));
    EXPECT_TRUE(wereRanked());
    expectNamed(chain(600), star(600));
    EXPECT_TRUE(wereRanked());
    EXPECT_EQ(askings(), 1);
    // Fewer changes than kShares, as many, and more.
    for (const std::uint32_t count :
         {1u, RankChange::kShares - 1, RankChange::kShares, RankChange::kShares + 1, 599u})
    {
        expectNamed(star(count), chain(600));
        EXPECT_TRUE(wereRanked()) << count;
    }
    expectNamed(chain(1000), star(1100));
    EXPECT_FALSE(wereRanked());
    EXPECT_EQ(askings(), 3) << "more than expected, and too many of one box";
}

TEST_F(SmallDeltaOutputs, RequestChangesTwiceOnlyWhenMoreThanExpected)
{
    expectNamed(chain(600), chain(601, 2));
    EXPECT_EQ(askings(), 2);
    expectNamed(chain(600), chain(700, 2));
    EXPECT_EQ(askings(), 1);
    expectNamed(chain(9000), chain(8000, 2));
    EXPECT_EQ(askings(), 2);
    expectNamed(chain(10), {});
    EXPECT_EQ(askings(), 1);
    expectNamed(chain(601), {});
    EXPECT_EQ(askings(), 2) << "few are expected again";
}

TEST_F(SmallDeltaOutputs, ReportChangesWhenAddedPairsFillOrOverfillHeldList)
{
    for (const std::uint64_t room : {602u, 601u, 600u, 400u, 1u, 0u})
    {
        SCOPED_TRACE(room);
        expectNamed(chain(600), chain(300, 2), room);
        EXPECT_EQ(askings(), 1);
    }
}

TEST_F(DeltaOutputs, ReportAllChangesOfBoxThatOverfillsItsBucket)
{
    for (const std::uint64_t ofOne : {OrderBucket::kOverfull - 1, OrderBucket::kOverfull})
    {
        expectNamed(star(static_cast<std::uint32_t>(ofOne)), {});
        EXPECT_EQ(askings(), ofOne < OrderBucket::kOverfull ? 1 : 2) << ofOne;
    }
}

TEST_F(DeltaOutputs, TryBucketsAgainSixteenUpdatesAfterBucketWasOverfull)
{
    expectNamed(chain(9000), {});
    expectNamed(star(9000), {});
    EXPECT_FALSE(wentByBuckets());
    int updates = 0;
    do
    {
        expectNamed(chain(9000), {});
        ++updates;
    } while (!wentByBuckets() && updates < 100);
    EXPECT_EQ(updates, 16);
}

TEST_F(DeltaOutputs, OrderChangesByBucketsAfterRecovery)
{
    expectNamed(chain(9000), chain(8000, 2));
    expectNamed(chain(8000), chain(9000, 2));
    for (int failure = 0; failure < 3; ++failure)
    {
        failWithBuckets(chain(7000), chain(8000, 3));
        recover();
        expectNamed(chain(9000), chain(8000, 2));
        EXPECT_TRUE(wentByBuckets());
        EXPECT_EQ(askings(), 1);
    }
}

TEST_F(DeltaOutputs, OrderChangesWhenOtherBoxesChangeThanBefore)
{
    // Boxes with large ids, then with small ids, then all.
    std::vector<RowPair> large, small;
    for (const RowPair& pair : chain(9000))
    {
        if (lesserId(pair) > 15000)
            large.push_back(pair);
        else if (lesserId(pair) < 5000)
            small.push_back(pair);
    }
    ASSERT_GT(small.size(), 1000u);
    ASSERT_GT(large.size(), 300u);
    for (int round = 0; round < 2; ++round)
    {
        expectNamed(large, {});
        expectNamed(small, {});
        expectNamed(chain(9000), chain(8000, 2));
    }
}

TEST_F(DeltaOutputs, PutFewSmallerIdsThanBeforeFirst)
{
    std::vector<RowPair> large, few;
    for (const RowPair& pair : chain(9000))
    {
        if (lesserId(pair) > 15000)
            large.push_back(pair);
        else if (lesserId(pair) < 5000 && few.size() < 5)
            few.push_back(pair);
    }
    ASSERT_GT(large.size(), 300u);
    ASSERT_EQ(few.size(), 5u);
    expectNamed(large, large);
    // The buckets fit large ids, and one bucket receives all smaller ones.
    few.insert(few.end(), large.begin(), large.end());
    expectNamed(few, few);
    EXPECT_TRUE(wentByBuckets());
    EXPECT_EQ(askings(), 1);
}

TEST_F(DeltaOutputs, WriteInPlaceIntoListsThatCallerReturns)
{
    expectNamed(chain(9000), chain(8000, 2));
    EXPECT_FALSE(wroteInPlace()) << "memory that may be used only once";
    const Pair* list = addedList();
    for (int update = 0; update < 3; ++update)
    {
        expectNamed(chain(9000 - static_cast<std::uint32_t>(update)), chain(8000, 2));
        EXPECT_EQ(addedList(), list);
        EXPECT_TRUE(wroteInPlace());
    }
    takeOtherLists();
    expectNamed(chain(8000), chain(9000, 2));
    expectNamed(chain(8000), chain(9000, 2));
    EXPECT_TRUE(wroteInPlace());
    lockNoLists();
    expectNamed(chain(8000, 2), chain(9000));
    EXPECT_FALSE(wroteInPlace());
    expectNamed(chain(8000), chain(9000, 2));
    EXPECT_FALSE(wroteInPlace());
}

TEST_F(LargeIdDeltaOutputs, OrderChangesOfLargestIds)
{
    expectNamed(chain(9000), chain(8000, 2));
    expectNamed(chain(9000), chain(8000, 2));
    EXPECT_TRUE(wentByBuckets());
    expectNamed(star(9000), {});
    EXPECT_FALSE(wentByBuckets());
}

/// Of an update that failed, or inserted pairs and was not completed, nothing may be found in the next one.
TEST(PsapUndecidedPairs, AreNoneInATableThatWasInUse)
{
    psap::HostExec exec({});
    psap::UndecidedPairs<psap::HostExec> pairs;
    for (const std::uint64_t room : {4u, 4u, 40u, 40u, 4u})
    {
        pairs.grow(exec, room);
        pairs.use(exec);
        std::uint64_t count = 0;
        const LookupTable table = pairs.table(&count);
        ASSERT_GE(table.limit(), room);
        EXPECT_EQ(std::count(table.slots, table.slots + table.mask + 1, LookupTable::kFree),
                  static_cast<std::ptrdiff_t>(table.mask + 1))
            << room;
        for (std::uint32_t i = 0; i < 4; ++i)
            table.insert({i, i + 1});
        EXPECT_EQ(count, 4u);
        EXPECT_TRUE(table.contains({3, 4}));
        pairs.setFree(false);
    }
}
}  // namespace cullet::test
