// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/pairs/pair_tests.h"
#include "cullet/broad/pairs/sorted_pairs.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace cullet::test
{
namespace
{
std::set<std::uint64_t> keysAmong(Random& random, std::uint32_t rows, std::size_t count)
{
    std::set<std::uint64_t> keys;
    while (keys.size() < count)
    {
        const std::uint32_t a = random.below(rows);
        const std::uint32_t b = random.below(rows);
        if (a != b)
            keys.insert(rowKey({a, b}));
    }
    return keys;
}

SortedPairs pairsOf(const std::set<std::uint64_t>& keys)
{
    PairKeys sorted(keys.begin(), keys.end());
    SortedPairs pairs;
    pairs.take(sorted);
    return pairs;
}

void expectSameAnswers(SortedPairs& pairs, std::set<std::uint64_t> keys,
                       const std::vector<std::uint64_t>& questions)
{
    for (const std::uint64_t key : questions)
    {
        ASSERT_EQ(pairs.contains(key), keys.count(key) != 0) << key;
        ASSERT_EQ(pairs.erase(key), keys.erase(key) != 0) << key;
        ASSERT_FALSE(pairs.contains(key)) << key;
        ASSERT_FALSE(pairs.erase(key)) << key;
    }
}

TEST(SortedPairs, ContainsNoKeyWhenEmpty)
{
    SortedPairs pairs;
    for (const std::uint64_t key : {std::uint64_t{0}, ~std::uint64_t{0}, rowKey({1, 2})})
    {
        EXPECT_FALSE(pairs.contains(key));
        EXPECT_FALSE(pairs.erase(key));
    }
    pairs = pairsOf({});
    EXPECT_FALSE(pairs.contains(0));
}

TEST(SortedPairs, ContainsAndErasesSameKeysAsSet)
{
    for (std::uint32_t seed = 1; seed <= 20; ++seed)
    {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        const std::uint32_t rows = 3 + random.below(300);
        const std::size_t count = 1 + random.below(rows * (rows - 1) / 2);
        const std::set<std::uint64_t> keys = keysAmong(random, rows, count);
        std::vector<std::uint64_t> questions;
        std::size_t hits = 0;
        for (int i = 0; i < 2000; ++i)
        {
            const std::uint32_t b = random.below(rows + 5), a = random.below(rows + 5);
            const std::uint64_t key = rowKey({a, b});
            questions.push_back(key);
            hits += keys.count(key);
        }
        EXPECT_GT(hits, 0u);
        EXPECT_LT(hits, questions.size());
        SortedPairs pairs = pairsOf(keys);
        expectSameAnswers(pairs, keys, questions);
    }
}

// Nearly all pairs are in one part of the divided range.
TEST(SortedPairs, FindsPairsWhenKeysAreClustered)
{
    std::set<std::uint64_t> keys = {rowKey({0, 1}), rowKey({0x3ffffffe, 0x3fffffff})};
    for (std::uint32_t row = 0; row < 5000; ++row)
        keys.insert(rowKey({77, 1000 + 3 * row}));
    std::vector<std::uint64_t> questions(keys.begin(), keys.end());
    for (std::uint32_t row = 0; row < 20000; ++row)
        questions.push_back(rowKey({77, 100 + row}));
    SortedPairs pairs = pairsOf(keys);
    expectSameAnswers(pairs, keys, questions);
}

TEST(SortedPairs, FindsLowestAndHighestPossibleKey)
{
    const std::set<std::uint64_t> keys = {0, 1, ~std::uint64_t{0} - 1, ~std::uint64_t{0}};
    SortedPairs pairs = pairsOf(keys);
    expectSameAnswers(pairs, keys,
                      {2, 0, ~std::uint64_t{0}, ~std::uint64_t{0} - 2, 1, ~std::uint64_t{0} - 1});
}

TEST(SortedPairs, ReplacesAllPairsWhenTakingOthers)
{
    SortedPairs pairs = pairsOf({3, 5, 9});
    EXPECT_TRUE(pairs.erase(5));
    PairKeys next = {4, 5};
    pairs.take(next);
    EXPECT_TRUE(pairs.contains(5));
    EXPECT_FALSE(pairs.contains(3));
    EXPECT_FALSE(pairs.contains(9));
}
}  // namespace
}  // namespace cullet::test
