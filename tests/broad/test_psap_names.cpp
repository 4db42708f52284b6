// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The changes of an update named by unique ids: in order whichever way they are sorted.

#include "broad/host_exec.h"
#include "broad/psap_names.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <random>
#include <vector>

namespace cullet::test
{
namespace
{
using psap::ChangeLists;
using psap::ChangeNames;
using psap::Counters;
using psap::LookupTable;
using psap::OrderRun;

/// HostExec that remembers from which bit on it sorted.
class WatchedExec : public psap::HostExec
{
public:
    using HostExec::HostExec;

    void sortKeys(const std::uint64_t* keys, std::uint64_t* sorted, std::uint64_t count, int firstBit,
                  int endBit)
    {
        firstBits.push_back(firstBit);
        HostExec::sortKeys(keys, sorted, count, firstBit, endBit);
    }

    std::vector<int> firstBits;
};

/// Rows of boxes, and their unique ids in another order.
class Names : public ::testing::Test
{
protected:
    explicit Names(std::uint32_t rows = 20000, std::uint32_t firstId = 1, std::uint64_t expected = 17000)
        : m_ids(rows), m_names(expected)
    {
        std::iota(m_ids.begin(), m_ids.end(), firstId);
        std::shuffle(m_ids.begin(), m_ids.end(), m_random);
    }

    /// `count` different pairs of neighbouring rows.
    std::vector<IdPair> chain(std::uint32_t count, std::uint32_t distance = 1) const
    {
        std::vector<IdPair> pairs(count);
        for (std::uint32_t i = 0; i < count; ++i)
            pairs[i] = {i, i + distance};
        return pairs;
    }

    /// Pairs of the row with the least id and others.
    std::vector<IdPair> star(std::uint32_t count) const
    {
        const auto least =
            static_cast<std::uint32_t>(std::min_element(m_ids.begin(), m_ids.end()) - m_ids.begin());
        std::vector<IdPair> pairs;
        for (std::uint32_t row = 0; pairs.size() < count; ++row)
        {
            if (row != least)
                pairs.push_back({row, least});
        }
        return pairs;
    }

    /// @param room of the list of pairs that are held
    void expectNamed(const std::vector<IdPair>& added, const std::vector<IdPair>& removed,
                     std::uint64_t room = 100000)
    {
        const std::uint32_t largest = *std::max_element(m_ids.begin(), m_ids.end());
        Counters counters{};
        counters.lists.added = added.size();
        counters.lists.removed = removed.size();
        counters.lists.kept = 1;
        const std::uint32_t sides = 77;
        std::vector<std::uint64_t> slots(64, 5);
        m_held.assign(room, IdPair{0, 0});
        const ChangeLists lists = {
            added.data(),   added.size(),
            removed.data(), m_held.data(),
            m_held.size(),  LookupTable{slots.data(), slots.size() - 1, &counters.lists.lookups},
            &counters,      &sides,
            m_ids.data()};
        PairDelta delta;
        m_exec.firstBits.clear();
        m_names.enqueue(m_exec, lists, largest);
        EXPECT_EQ(m_names.counters().lists.added, added.size());
        EXPECT_EQ(m_names.counters().side, sides);
        m_names.take(m_exec, lists, largest, false, delta);
        EXPECT_EQ(delta.added, named(added));
        EXPECT_EQ(delta.removed, named(removed));
        EXPECT_EQ(slots, std::vector<std::uint64_t>(64, LookupTable::kFree));
        for (std::size_t i = 0; i < added.size(); ++i)
            ASSERT_TRUE(m_held[i + 1].a == added[i].a && m_held[i + 1].b == added[i].b) << i;
    }

    /// How many sorts the last call took.
    std::size_t sorts() const { return m_exec.firstBits.size() / 2; }

    /// Whether the last call sorted by the first ids, then needed no other sort.
    bool wentByRuns() const
    {
        return m_exec.firstBits.front() != 0 &&
               std::count(m_exec.firstBits.begin(), m_exec.firstBits.end(), 0) == 0;
    }

private:
    std::vector<Pair> named(const std::vector<IdPair>& pairs) const
    {
        std::vector<Pair> names;
        for (const IdPair& pair : pairs)
            names.push_back({std::min(m_ids[pair.a], m_ids[pair.b]), std::max(m_ids[pair.a], m_ids[pair.b])});
        std::sort(names.begin(), names.end());
        return names;
    }

    std::mt19937 m_random{7};
    std::vector<std::uint32_t> m_ids;
    WatchedExec m_exec{PsapOptions{}};
    std::vector<IdPair> m_held;
    ChangeNames<WatchedExec> m_names;
};

/// Where few changes are expected.
class FewNames : public Names
{
protected:
    FewNames() : Names(20000, 1, 1000) {}
};

/// Ids so large that no bit is left to tell what comes from what goes.
class LargeNames : public Names
{
protected:
    LargeNames() : Names(20000, 0xffff0000u, 17000) {}
};
}  // namespace

TEST_F(Names, ManyChangesOfManyBoxesAreSortedByHalfOfTheirKeys)
{
    expectNamed(chain(9000), chain(8000, 2));
    EXPECT_TRUE(wentByRuns());
    expectNamed(chain(9000), {});
    EXPECT_TRUE(wentByRuns());
    expectNamed({}, chain(9000, 3));
    EXPECT_TRUE(wentByRuns());
}

TEST_F(FewNames, FewChangesAreSortedAtOnce)
{
    expectNamed(chain(100), chain(50, 2));
    EXPECT_FALSE(wentByRuns());
    expectNamed({}, {});
}

TEST_F(FewNames, MoreChangesThanExpectedAreAskedForAgainAndThenExpected)
{
    expectNamed(chain(600), chain(401, 2));
    EXPECT_EQ(sorts(), 2u);
    expectNamed(chain(600), chain(500, 2));
    EXPECT_EQ(sorts(), 1u);
    expectNamed(chain(9000), chain(8000, 2));
    EXPECT_EQ(sorts(), 2u);
    expectNamed(chain(10), {});
    EXPECT_EQ(sorts(), 1u);
    expectNamed(chain(1001), {});
    EXPECT_EQ(sorts(), 2u) << "few are expected again";
}

TEST_F(FewNames, APairThatFindsNoRoomAmongTheHeldIsNamedAllTheSame)
{
    expectNamed(chain(600), chain(300, 2), 601);
    EXPECT_EQ(sorts(), 1u);
}

TEST_F(Names, ABoxWithManyChangesIsSortedAsWell)
{
    for (const std::uint32_t ofOne : {OrderRun::kLongest - 1, OrderRun::kLongest})
    {
        std::vector<IdPair> added = chain(9000);
        const std::vector<IdPair> others = star(static_cast<std::uint32_t>(ofOne));
        // The chain has up to two pairs of that box itself.
        added.erase(std::remove_if(added.begin(), added.end(),
                                   [&](const IdPair& pair)
                                   { return pair.a == others[0].b || pair.b == others[0].b; }),
                    added.end());
        added.insert(added.end(), others.begin(), others.end());
        expectNamed(added, chain(8000, 2));
        EXPECT_EQ(wentByRuns(), ofOne < OrderRun::kLongest) << ofOne;
    }
}

TEST_F(Names, AfterABoxWithManyChangesHalfOfTheKeyIsTriedAgainOnlyLater)
{
    expectNamed(star(9000), {});
    EXPECT_FALSE(wentByRuns());
    int updates = 0;
    do
    {
        expectNamed(chain(9000), {});
        ++updates;
    } while (!wentByRuns() && updates < 100);
    EXPECT_EQ(updates, 16);
}

TEST_F(LargeNames, WithoutABitToSpareAreSortedApart)
{
    expectNamed(chain(9000), chain(8000, 2));
    EXPECT_FALSE(wentByRuns());
}
}  // namespace cullet::test
