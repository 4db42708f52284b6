// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/pair.h"
#include "cullet/plugin/pair_sync/partner_lists.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
using Flags = std::map<std::pair<std::uint32_t, std::uint32_t>, bool>;  // lower row first

std::pair<std::uint32_t, std::uint32_t> sorted(std::uint32_t a, std::uint32_t b)
{
    return {std::min(a, b), std::max(a, b)};
}

/// The pairs that the lists of the rows have: each twice, or once if only those above the row are asked for.
Flags visited(PartnerLists& lists, std::uint32_t rows, bool above)
{
    Flags found;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> times;
    for (std::uint32_t row = 0; row < rows; ++row)
    {
        const auto note = [&](std::uint32_t partner, bool flag)
        {
            found[sorted(row, partner)] = flag;
            ++times[sorted(row, partner)];
            return flag;
        };
        if (above)
            lists.updateFlagsAbove(row, note);
        else
            lists.updateFlagsOf(row, note);
    }
    for (const auto& [pair, count] : times)
        EXPECT_EQ(count, above ? 1 : 2) << pair.first << ' ' << pair.second;
    return found;
}

TEST(PartnerLists, HavePairsAndFlagsOfOracleAfterRandomChanges)
{
    constexpr std::uint32_t kSeed = 40, kRows = 24;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    Random random(kSeed);
    PartnerLists lists;
    lists.growTo(kRows);
    Flags expected;
    std::size_t most = 0, erased = 0, flipped = 0;
    for (int step = 0; step < 3000; ++step)
    {
        const std::uint32_t a = random.below(kRows);
        const std::uint32_t b = (a + 1 + random.below(kRows - 1)) % kRows;
        const bool flag = random.chance(0.5f);
        const std::uint32_t choice = random.below(20);
        if (choice < 12)
        {
            lists.insert(a, b, flag);
            expected[sorted(a, b)] = flag;
        }
        else if (choice < 16)
        {
            lists.erase(a, b);
            erased += expected.erase(sorted(a, b));
        }
        else if (choice < 18)
        {
            const auto flip = [&](std::uint32_t partner, bool before)
            {
                const bool after = before != (partner % 3 == 0);
                expected[sorted(a, partner)] = after;
                flipped += before != after ? 1u : 0u;
                return after;
            };
            lists.updateFlagsOf(a, flip);
        }
        else if (choice == 18)
        {
            lists.eraseIf(a,
                          [&](std::uint32_t partner, bool has)
                          {
                              EXPECT_EQ(has, expected.at(sorted(a, partner)));
                              return has == flag && expected.erase(sorted(a, partner)) != 0;
                          });
        }
        else if (step % 5 == 0)
        {
            lists.eraseAllOf(a);
            for (std::uint32_t row = 0; row < kRows; ++row)
                expected.erase(sorted(a, row));
        }
        ASSERT_EQ(lists.size(), expected.size()) << step;
        ASSERT_EQ(visited(lists, kRows, step % 2 == 0), expected) << step;
        most = std::max(most, expected.size());
    }
    EXPECT_GT(most, 100u);
    EXPECT_GT(erased, 50u);
    EXPECT_GT(flipped, 100u);
}

TEST(PartnerLists, RemovePartnersFromAscendingRows)
{
    PartnerLists lists;
    lists.growTo(10);
    for (const std::uint32_t partner : {7u, 0u, 9u, 4u})
        lists.insert(3, partner, partner % 2 == 0);
    std::vector<std::uint32_t> rows = {1, 4, 5, 7, 8, 9};
    lists.removePartners(3, rows);
    EXPECT_EQ(rows, (std::vector<std::uint32_t>{1, 5, 8}));
    lists.removePartners(2, rows);
    EXPECT_EQ(rows.size(), 3u);
}

TEST(PartnerLists, KeepPairsAndFlagsWhenEntriesBecomeLarger)
{
    constexpr std::uint32_t kFew = 1u << 15, kRows = kFew + 40;
    Random random(40);
    PartnerLists lists;
    lists.growTo(kFew);
    Flags expected;
    const auto insertSome = [&](std::uint32_t rows)
    {
        for (int i = 0; i < 500; ++i)
        {
            const std::uint32_t a = rows - 1 - random.below(60), b = random.below(20);
            const bool flag = random.chance(0.5f);
            lists.insert(a, b, flag);
            expected[sorted(a, b)] = flag;
        }
    };
    insertSome(kFew);
    ASSERT_EQ(visited(lists, kFew, true), expected);
    EXPECT_GT(expected.size(), 300u);
    const std::uint64_t before = lists.bytes();
    lists.growTo(kRows);
    EXPECT_GT(lists.bytes(), before);
    ASSERT_EQ(visited(lists, kRows, false), expected);
    insertSome(kRows);
    EXPECT_GT(expected.rbegin()->first.second, kFew)
        << "the sample has rows beyond the limit of the small entries";
    ASSERT_EQ(visited(lists, kRows, true), expected);
    EXPECT_EQ(lists.size(), expected.size());
}

TEST(PartnerLists, TakeFiveBytesForEachOfManyPairsOfFewRowsAndTenOfMany)
{
    constexpr std::uint32_t kRows = 1000;
    PartnerLists lists;
    lists.growTo(kRows);
    for (std::uint32_t a = 0; a < kRows; ++a)
    {
        for (std::uint32_t b = a + 1; b < kRows; b += 3)
            lists.insert(a, b, true);
    }
    EXPECT_GT(lists.size(), 150000u);
    EXPECT_LE(lists.bytes(), 5 * lists.size() + 32 * kRows);
    constexpr std::uint32_t kManyRows = 1u << 16;
    lists.growTo(kManyRows);
    lists.insert(0, kManyRows - 1, true);
    EXPECT_LE(lists.bytes(), 10 * lists.size() + 24 * kManyRows + 8 * kRows);
}
}  // namespace
}  // namespace cullet::test
