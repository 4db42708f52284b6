// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// What a C program cannot bring about: a backend that fails.
#include "broad/log.h"
#include "tests/plugin/fake_backends.h"

#include <gtest/gtest.h>

#include "abi/box_set.h"

namespace cullet::test
{
namespace
{
constexpr int kBoxes = 10;

int warningCount = 0;

/// A row of unit cubes, each touching the next.
abi::BoxArray row(std::vector<Aabb>& boxes, float spacing)
{
    boxes.clear();
    for (int i = 0; i < kBoxes; ++i)
        boxes.push_back({{spacing * float(i), 0, 0}, {spacing * float(i) + 1, 1, 1}});
    return {boxes[0].min, sizeof(Aabb)};
}

class BoxSetFailure : public testing::TestWithParam<Status>
{
};

TEST_P(BoxSetFailure, OfABackendIsNoticedByNothingButAWarning)
{
    warningCount = 0;
    setLogFunction([](LogLevel level, const char*) { warningCount += level == LogLevel::Warning; });
    abi::BoxSet set(std::make_unique<FailingBackend>(1, GetParam()), 1, 0.0f);
    std::vector<Aabb> boxes;
    std::uint32_t ids[kBoxes];
    ASSERT_TRUE(set.add(row(boxes, 1), kBoxes, ids));
    set.update();
    EXPECT_EQ(set.pairs().size(), 9u);

    // Fails here: every second box goes up, but for the last one, and only one pair is left.
    std::vector<std::uint32_t> moved;
    for (int i = 1; i < kBoxes - 2; i += 2)
        moved.push_back(ids[i]);
    std::vector<Aabb> above(moved.size(), Aabb{{0, 50, 0}, {1, 51, 1}});
    for (std::size_t i = 0; i < above.size(); ++i)
        above[i].min[0] = above[i].max[0] = 10.0f * float(i);
    ASSERT_TRUE(set.move(moved.data(), {above[0].min, sizeof(Aabb)}, std::uint32_t(moved.size())));
    set.update();
    EXPECT_EQ(set.pairs(), (Pairs{{ids[8], ids[9]}}));
    EXPECT_TRUE(set.delta().added.empty());
    EXPECT_EQ(set.delta().removed.size(), 8u);

    cullet_box_set_stats stats = {};
    set.fill(stats);
    EXPECT_EQ(stats.fallbacks, 1u);
    EXPECT_STREQ(stats.backend, "grid");
    EXPECT_EQ(warningCount, 1);
    ASSERT_TRUE(set.move(ids, row(boxes, 0.9f), kBoxes));
    set.update();
    EXPECT_EQ(set.pairs().size(), 9u);
    setLogFunction(nullptr);
}

INSTANTIATE_TEST_SUITE_P(Kinds, BoxSetFailure, testing::Values(Status::DeviceLost, Status::OutOfMemory));
}  // namespace
}  // namespace cullet::test
