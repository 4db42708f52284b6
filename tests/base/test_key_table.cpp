// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/base/key_table.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <map>

namespace cullet::test
{
namespace
{
struct CountSlot
{
    std::uint64_t key = kFreeKey;
    std::uint32_t count = 0;
};
}  // namespace

TEST(KeyTable, MatchesMapUnderRandomChanges)
{
    constexpr std::uint32_t kSeed = 38;
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    KeyTable<CountSlot> table;
    std::map<std::uint64_t, std::uint32_t> counts;
    std::size_t erased = 0, found = 0;
    for (std::uint32_t step = 0; step < 200000; ++step)
    {
        // Keys that differ in their upper half only, as those of one row's pairs, collide where a hash is poor.
        const std::uint64_t key = std::uint64_t{random.below(400)} << 32 | random.below(3);
        if (random.below(5) < 2)
        {
            erased += counts.count(key);
            ASSERT_EQ(table.erase(key), counts.erase(key) != 0) << step;
        }
        else
        {
            found += counts.count(key);
            ASSERT_EQ(++table.insert(key).count, ++counts[key]) << step;
        }
        ASSERT_EQ(table.count(), counts.size()) << step;
    }
    EXPECT_GT(erased, 10000u);
    EXPECT_GT(found, 10000u);
    table.forEach([&](const CountSlot& slot) { EXPECT_EQ(counts[slot.key], slot.count); });
    for (std::uint64_t row = 0; row < 400; ++row)
        EXPECT_EQ(table.contains(row << 32), counts.count(row << 32) != 0) << row;
}

TEST(KeyTable, ContainsNothingBeforeAndAfterUse)
{
    KeySet set;
    EXPECT_TRUE(set.isEmpty());
    EXPECT_FALSE(set.contains(0));
    EXPECT_FALSE(set.erase(0));
    EXPECT_EQ(set.find(0), nullptr);
    set.insert(0);
    EXPECT_TRUE(set.contains(0));
    EXPECT_EQ(set.count(), 1u);
    set.reset(100);
    EXPECT_TRUE(set.isEmpty());
    EXPECT_FALSE(set.contains(0));
}
}  // namespace cullet::test
