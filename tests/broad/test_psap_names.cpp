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
using psap::ChangeNames;
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
    explicit Names(std::uint32_t rows = 20000, std::uint32_t firstId = 1) : m_ids(rows)
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

    void expectNamed(const std::vector<IdPair>& added, const std::vector<IdPair>& removed)
    {
        const std::uint32_t largest = *std::max_element(m_ids.begin(), m_ids.end());
        PairDelta delta;
        m_exec.firstBits.clear();
        m_names.fetch(m_exec, {added.data(), added.size()}, {removed.data(), removed.size()}, m_ids.data(),
                      largest, delta);
        EXPECT_EQ(delta.added, named(added));
        EXPECT_EQ(delta.removed, named(removed));
    }

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
    ChangeNames<WatchedExec> m_names;
};

/// Ids so large that no bit is left to tell what comes from what goes.
class LargeNames : public Names
{
protected:
    LargeNames() : Names(20000, 0xffff0000u) {}
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

TEST_F(Names, FewChangesAreSortedAtOnce)
{
    expectNamed(chain(100), chain(50, 2));
    EXPECT_FALSE(wentByRuns());
    expectNamed({}, {});
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
