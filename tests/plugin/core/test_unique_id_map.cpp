// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/core/unique_id_map.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
TEST(UniqueIdMap, CountsPagesOfLiveIdsAndTableOfAllPages)
{
    constexpr std::uint64_t kPage = 4096, kTable = 8 * 1025;
    UniqueIdMap map;
    EXPECT_EQ(map.bytes(), 0u);
    map.insert(1, 5);
    map.insert(1u << 20, 6);
    const std::uint64_t ofTwo = map.bytes();
    EXPECT_GE(ofTwo, kTable + 2 * kPage);
    EXPECT_LE(ofTwo, 2 * kTable + 3 * kPage);
    map.erase(1);
    EXPECT_GE(ofTwo - map.bytes(), kPage) << "a page without live ids";
    EXPECT_EQ(map.find(1u << 20), 6u);
    map.erase(1u << 20);
    EXPECT_GE(map.bytes(), kTable);
    EXPECT_LE(map.bytes(), 2 * kTable);
    map.clear();
    EXPECT_EQ(map.bytes(), 0u);
}
}  // namespace
}  // namespace cullet::test
