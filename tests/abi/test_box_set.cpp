// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Conditions that a C program cannot cause: a failing backend, and failing allocations.
#include "cullet/abi/box_set.h"
#include "cullet/abi/status.h"
#include "cullet/broad/log.h"
#include "cullet/tests/plugin/log_scope.h"
#include "cullet/tests/plugin/pair_sync/fake_backends.h"
#include "cullet/tests/support/process/failing_new.h"

#include <gtest/gtest.h>

#include <new>
#include <numeric>

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

TEST_P(BoxSetFailure, LosesNoPairAndLogsOneWarningWhenBackendFails)
{
    warningCount = 0;
    setLogFunction([](LogLevel level, const char*) { warningCount += level == LogLevel::Warning; });
    abi::BoxSet set(std::make_unique<FailingBackend>(1, GetParam()), 1, 0.0f);
    std::vector<Aabb> boxes;
    std::uint32_t ids[kBoxes];
    ASSERT_TRUE(set.add(row(boxes, 1), kBoxes, ids));
    set.update();
    EXPECT_EQ(set.pairs().size(), 9u);

    // The failing update: every second box except the last one moves up, and only one pair remains.
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

/// A row of touching cubes after one update; since then every second pair of cubes was removed, and others were added.
class ChangedRow
{
public:
    ChangedRow() : set(makeGrid(), 1, 0.0f)
    {
        addAt(0);
        set.update();
        before = set.pairs();
        std::vector<std::uint32_t> leaving;
        for (std::uint32_t id = 1; id < kCubes; id += 4)
            leaving.insert(leaving.end(), {id, id + 1});
        set.remove(leaving.data(), std::uint32_t(leaving.size()));
        addAt(5);
    }

    /// False if an allocation fails.
    bool tryUpdate()
    {
        try
        {
            set.update();
            return true;
        }
        catch (const abi::Failure& failure)
        {
            EXPECT_EQ(failure.status, CULLET_ERROR_MEMORY);
        }
        catch (const std::bad_alloc&)
        {
        }
        return false;
    }

    abi::BoxSet set;
    Pairs before;  ///< of the first update

private:
    static constexpr std::uint32_t kCubes = 2000;

    static std::unique_ptr<Backend> makeGrid()
    {
        GridOptions options;
        options.threads = 1;
        return makeGridBackend(options);
    }

    void addAt(float height)
    {
        std::vector<Aabb> boxes;
        for (std::uint32_t i = 0; i < kCubes; ++i)
            boxes.push_back({{float(i), height, 0}, {float(i) + 1, height + 1, 1}});
        std::vector<std::uint32_t> ids(kCubes);
        EXPECT_TRUE(set.add({boxes[0].min, sizeof(Aabb)}, kCubes, ids.data()));
    }
};

TEST(BoxArray, ReadsCornersAtTheirStridesAndRoundsDoublesOutward)
{
    // Coordinates of a box are 16 bytes apart, boxes 8, the second one first.
    const double third = 1.0 / 3.0;
    const double min[] = {third, 0, 2, -third, 4, 5}, max[] = {9, third, 9, 9, 9, 9};
    const auto corners = [](const double* first) {
        return abi::CornerArray{reinterpret_cast<const unsigned char*>(first + 1), -8, 16, true};
    };
    const abi::BoxArray boxes(corners(min), corners(max));
    const Aabb outer = boxes.at(0);
    EXPECT_EQ(outer.min[0], 0.0f);
    EXPECT_LT(double(outer.min[1]), -third);
    EXPECT_GT(double(outer.max[0]), third);
    EXPECT_EQ(boxes.at(1).max[2], 9.0f);
    EXPECT_LT(double(boxes.at(1).min[0]), third);
}

TEST(BoxArray, KeepsInvertedBoxOfDoublesEmptyWhenFloatsAreEqual)
{
    const double min[] = {0.5 + 1e-12, 0, 0}, max[] = {0.5, 1, 1};
    ASSERT_EQ(float(min[0]), float(max[0]));
    const auto corners = [](const double* first) {
        return abi::CornerArray{reinterpret_cast<const unsigned char*>(first), 24, 8, true};
    };
    EXPECT_FALSE(isValid(abi::BoxArray(corners(min), corners(max)).at(0)));
}

TEST(BoxSetMemory, KeepsPairsWhenUpdateRunsOutOfMemoryAndFindsAllNextTime)
{
    const LogScope log;  // a backend whose allocation fails is replaced, with a warning
    ChangedRow expected;
    expected.set.update();
    ASSERT_EQ(expected.set.delta().added.size(), 1999u);
    ASSERT_EQ(expected.set.delta().removed.size(), 1499u);
    int failures = 0;
    bool isReached = true;
    for (std::uint64_t after = 0; isReached; ++after)
    {
        SCOPED_TRACE(after);
        ChangedRow row;
        bool isDone = false;
        {
            const OneNewFails failure(after);
            isDone = row.tryUpdate();
            isReached = failure.hasHappened();
        }
        if (!isDone)
        {
            ++failures;
            EXPECT_EQ(row.set.pairs(), row.before);
            row.set.update();
        }
        EXPECT_EQ(row.set.pairs(), expected.set.pairs());
        EXPECT_EQ(row.set.delta().added, expected.set.delta().added);
        EXPECT_EQ(row.set.delta().removed, expected.set.delta().removed);
    }
    EXPECT_GT(failures, 0) << "the list of all pairs, at least";
}

INSTANTIATE_TEST_SUITE_P(Kinds, BoxSetFailure, testing::Values(Status::DeviceLost, Status::OutOfMemory));
}  // namespace
}  // namespace cullet::test
