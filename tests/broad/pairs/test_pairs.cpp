// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/pairs/update_held_pairs.h"
#include "cullet/tests/support/pair_hash.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace cullet::test
{
namespace
{
Pairs randomPairs(Random& random, std::uint32_t idCount, float density)
{
    Pairs pairs;
    for (std::uint32_t first = 1; first <= idCount; ++first)
    {
        for (std::uint32_t second = first + 1; second <= idCount; ++second)
        {
            if (random.chance(density))
                pairs.push_back({first, second});
        }
    }
    return pairs;
}

TEST(Pair, HasTheLowerIdFirst)
{
    EXPECT_EQ(makePair(7, 3), (Pair{3, 7}));
    EXPECT_EQ(makePair(3, 7), (Pair{3, 7}));
    EXPECT_EQ(makePair(0xffffffffu, 0x80000000u), (Pair{0x80000000u, 0xffffffffu}));
}

TEST(Pair, SortsInSameOrderAsItsKey)
{
    const Pairs sorted = {{1, 2}, {1, 0x80000000u}, {1, 0xffffffffu}, {2, 3}, {0x80000000u, 0xffffffffu}};
    for (std::size_t i = 0; i < sorted.size(); ++i)
    {
        EXPECT_EQ(pairOfKey(pairKey(sorted[i])), sorted[i]);
        for (std::size_t j = 0; j < sorted.size(); ++j)
        {
            EXPECT_EQ(sorted[i] < sorted[j], i < j);
            EXPECT_EQ(pairKey(sorted[i]) < pairKey(sorted[j]), i < j);
        }
    }
}

/// updateHeldPairs() against sets, for a random filter and margin.
TEST(UpdateHeldPairs, AppliesFilterToPairsThatEnterAndMarginToThoseThatLeave)
{
    SCOPED_TRACE("seed 2");
    Random random(2);
    std::uint64_t entered = 0, refused = 0, stayed = 0, left = 0;
    Pairs held;
    for (int round = 0; round < 300; ++round)
    {
        const Pairs overlapping = randomPairs(random, 12, random.unit());
        const Pairs wanted = randomPairs(random, 12, 0.7f);
        const Pairs near = randomPairs(random, 12, 0.5f);
        const auto in = [](const Pairs& list, Pair pair)
        { return std::binary_search(list.begin(), list.end(), pair); };

        const Pairs before = held;
        PairDelta expected;
        Pairs expectedHeld;
        for (const Pair pair : randomPairs(random, 12, 1.0f))
        {
            const bool isOld = in(before, pair);
            const bool isIn = in(overlapping, pair) ? isOld || in(wanted, pair) : isOld && in(near, pair);
            if (isIn)
                expectedHeld.push_back(pair);
            if (isIn && !isOld)
                expected.added.push_back(pair);
            if (!isIn && isOld)
                expected.removed.push_back(pair);
            refused += !isIn && !isOld && in(overlapping, pair) ? 1 : 0;
            stayed += isIn && !in(overlapping, pair) ? 1 : 0;
        }
        PairDelta delta;
        updateHeldPairs(
            held, overlapping, [&](Pair pair) { return in(wanted, pair); },
            [&](Pair pair) { return in(near, pair); }, delta);
        ASSERT_EQ(held, expectedHeld) << "round " << round;
        ASSERT_EQ(delta.added, expected.added) << "round " << round;
        ASSERT_EQ(delta.removed, expected.removed) << "round " << round;
        entered += delta.added.size();
        left += delta.removed.size();
    }
    for (const std::uint64_t count : {entered, refused, stayed, left})
        EXPECT_GT(count, 1000u);
}

TEST(PairStreamHash, EqualsFnv1aForEmptyStreamAndEmptyDelta)
{
    // The empty stream is the offset basis; one empty delta is eight zero bytes.
    PairStreamHash empty;
    EXPECT_EQ(empty.value(), 14695981039346656037ull);
    std::uint64_t zeros = 14695981039346656037ull;
    for (int i = 0; i < 8; ++i)
        zeros *= 1099511628211ull;
    empty.add({});
    EXPECT_EQ(empty.value(), zeros);
}

TEST(PairStreamHash, EqualsFnv1aOfBytesOfWordsInOrder)
{
    const auto fnv1a = [](const std::vector<unsigned char>& bytes)
    {
        std::uint64_t hash = 0xcbf29ce484222325u;
        for (const unsigned char byte : bytes)
            hash = (hash ^ byte) * 0x100000001b3u;
        return hash;
    };
    // From the authors' list of test vectors.
    ASSERT_EQ(fnv1a({'a'}), 0xaf63dc4c8601ec8cu);
    ASSERT_EQ(fnv1a({'f', 'o', 'o', 'b', 'a', 'r'}), 0x85944171f73967e8u);

    PairStreamHash hash;
    hash.add({{{1, 2}, {0x01020304, 0xfffefdfc}}, {{0x8000, 0x10000}}});
    std::vector<unsigned char> bytes = {2, 0,    0, 0,                          // added
                                        1, 0,    0, 0, 2,    0,    0,    0,     // first and second
                                        4, 3,    2, 1, 0xfc, 0xfd, 0xfe, 0xff,  //
                                        1, 0,    0, 0,                          // removed
                                        0, 0x80, 0, 0, 0,    0,    1,    0};
    EXPECT_EQ(hash.value(), fnv1a(bytes));
    hash.add({{}, {{7, 9}}});
    bytes.insert(bytes.end(), {0, 0, 0, 0, 1, 0, 0, 0, 7, 0, 0, 0, 9, 0, 0, 0});
    EXPECT_EQ(hash.value(), fnv1a(bytes));
}

TEST(PairStreamHash, DependsOnOrderSideAndTimeOfPairs)
{
    const PairDelta one{{{1, 2}}, {}};
    const PairDelta two{{}, {{1, 2}}};
    const PairDelta both{{{1, 2}, {3, 4}}, {}};
    const PairDelta turned{{{3, 4}, {1, 2}}, {}};
    std::set<std::uint64_t> values;
    for (const std::vector<PairDelta>& stream : std::vector<std::vector<PairDelta>>{
             {one}, {two}, {both}, {turned}, {{}, one}, {one, {}}, {one, two}, {}})
    {
        PairStreamHash hash;
        for (const PairDelta& delta : stream)
            hash.add(delta);
        values.insert(hash.value());
    }
    EXPECT_EQ(values.size(), 8u);
}
}  // namespace
}  // namespace cullet::test
