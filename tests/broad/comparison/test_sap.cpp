// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Incremental sweep and prune: the swap cases and sweeps of Lesson 04, and the counters.

#include "cullet/comparison/backends.h"
#include "cullet/comparison/comparison_stats.h"
#include "cullet/comparison/sap_backend.h"
#include "cullet/comparison/sap_endpoints.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
using Rows = std::set<std::pair<std::uint32_t, std::uint32_t>>;

/// "SAP - Algorithm Principle": orders on x 1 3 3' 4 1' 4' 5 5' 2 2' and on y 4 1 1' 5 4' 2 3 5' 3' 2' (' = end). Row 0
/// is unused, so that rows are the labels of the slide.
const std::vector<Aabb> kSlide = {kEmptyAabb,
                                  {{0, 1, 0}, {4, 2, 1}},
                                  {{8, 5, 0}, {9, 9, 1}},
                                  {{1, 6, 0}, {2, 8, 1}},
                                  {{3, 0, 0}, {5, 4, 1}},
                                  {{6, 3, 0}, {7, 7, 1}}};

EndpointList listOf(int axis, const std::vector<Aabb>& boxes)
{
    std::vector<std::uint32_t> rows;
    for (std::uint32_t row = 0; row < boxes.size(); ++row)
    {
        if (isValid(boxes[row]))
            rows.push_back(row);
    }
    EndpointList list(axis);
    list.insert(rows, boxes);
    return list;
}

/// Pairs that the sweep of the slides reports, and the sets of open intervals during it.
Rows sweep(const EndpointList& list, std::vector<std::vector<std::uint32_t>>* sets = nullptr)
{
    Rows pairs;
    std::vector<std::uint32_t> open;
    for (const EndpointList::Endpoint& limit : list.endpoints())
    {
        if (limit.side() == EndpointSide::End)
        {
            open.erase(std::find(open.begin(), open.end(), limit.row()));
        }
        else
        {
            for (const std::uint32_t other : open)
                pairs.insert(std::minmax(limit.row(), other));
            open.push_back(limit.row());
        }
        if (sets != nullptr)
            sets->push_back(open);
    }
    return pairs;
}

Rows overlapsAlong(int axis, const std::vector<Aabb>& boxes)
{
    Rows pairs;
    for (std::uint32_t a = 0; a < boxes.size(); ++a)
    {
        for (std::uint32_t b = a + 1; b < boxes.size(); ++b)
        {
            if (boxes[a].min[axis] <= boxes[b].max[axis] && boxes[b].min[axis] <= boxes[a].max[axis])
                pairs.insert({a, b});
        }
    }
    return pairs;
}

TEST(EndpointEvent, DistinguishesEightCasesOfPassingLimits)
{
    constexpr EndpointSide kStart = EndpointSide::Start;
    constexpr EndpointSide kEnd = EndpointSide::End;
    struct Case
    {
        EndpointSide moving;
        bool movesRight;
        EndpointSide passed;
        EndpointEvent event;
    };
    const Case cases[] = {
        {kStart, true, kStart, EndpointEvent::Nothing},
        {kStart, true, kEnd, EndpointEvent::OverlapEnds},
        {kStart, false, kStart, EndpointEvent::Nothing},
        {kStart, false, kEnd, EndpointEvent::OverlapBegins},
        {kEnd, true, kStart, EndpointEvent::OverlapBegins},
        {kEnd, true, kEnd, EndpointEvent::Nothing},
        {kEnd, false, kStart, EndpointEvent::OverlapEnds},
        {kEnd, false, kEnd, EndpointEvent::Nothing},
    };
    for (const Case& entry : cases)
    {
        EXPECT_EQ(endpointEvent(entry.moving, entry.movesRight, entry.passed), entry.event)
            << static_cast<int>(entry.moving) << entry.movesRight << static_cast<int>(entry.passed);
    }
}

TEST(EndpointList, ReportsOverlapEventsOfAllEightCasesWhenBoxMoves)
{
    // Box 0 stays at [4, 6]; box 1 moves so that one of its limits passes a limit of box 0.
    struct Move
    {
        float beforeStart, beforeEnd, afterStart, afterEnd;
        std::uint64_t swaps;
        std::vector<EndpointEvent> events;
    };
    const Move moves[] = {
        {3, 7, 5, 7, 1, {}},                              // start right over start
        {5, 8, 7, 8, 1, {EndpointEvent::OverlapEnds}},    // start right over end
        {5, 7, 3, 7, 1, {}},                              // start left over start
        {7, 8, 5, 8, 1, {EndpointEvent::OverlapBegins}},  // start left over end
        {1, 2, 1, 5, 1, {EndpointEvent::OverlapBegins}},  // end right over start
        {1, 5, 1, 7, 1, {}},                              // end right over end
        {1, 5, 1, 3, 1, {EndpointEvent::OverlapEnds}},    // end left over start
        {1, 7, 1, 5, 1, {}},                              // end left over end
        {1, 2, 1, 4, 1, {EndpointEvent::OverlapBegins}},  // they touch
        {6, 8, 5, 8, 0, {}},                              // they touched already
        {1, 5, 5, 9, 2, {}},                              // start over start, end over end
        {1, 5, 8, 9, 3, {EndpointEvent::OverlapEnds}},    // through it; the end goes first
        {1, 2, 8, 9, 4, {EndpointEvent::OverlapBegins, EndpointEvent::OverlapEnds}},
    };
    for (const Move& move : moves)
    {
        std::vector<Aabb> boxes = {cube(4, 6), cube(move.beforeStart, move.beforeEnd)};
        EndpointList list = listOf(0, boxes);
        std::vector<EndpointEvent> events;
        list.move(1, cube(move.afterStart, move.afterEnd),
                  [&](std::uint32_t other, EndpointEvent event)
                  {
                      EXPECT_EQ(other, 0u);
                      events.push_back(event);
                  });
        EXPECT_EQ(events, move.events) << move.afterStart << " " << move.afterEnd;
        EXPECT_EQ(list.swapsTotal(), move.swaps) << move.afterStart << " " << move.afterEnd;
    }
}

TEST(EndpointList, KeepsOrderAndReportsExactChangesUnderRandomMoves)
{
    SCOPED_TRACE("seed 1");
    Random random(1);
    std::vector<Aabb> boxes;
    const auto randomInterval = [&]
    {
        // Coordinates on a lattice, so that limits are often equal.
        const float start = static_cast<float>(random.below(40));
        return cube(start, start + static_cast<float>(random.below(6)));
    };
    for (int i = 0; i < 40; ++i)
        boxes.push_back(randomInterval());
    EndpointList list = listOf(1, boxes);
    Rows pairs = overlapsAlong(1, boxes);
    std::uint64_t begins = 0, ends = 0;
    for (int step = 0; step < 5000; ++step)
    {
        const std::uint32_t row = random.below(40);
        boxes[row] = randomInterval();
        list.move(row, boxes[row],
                  [&](std::uint32_t other, EndpointEvent event)
                  {
                      const auto pair = std::minmax(row, other);
                      if (event == EndpointEvent::OverlapBegins)
                          begins += pairs.insert(pair).second ? 1 : 0;
                      else
                          ends += pairs.erase(pair);
                  });
        ASSERT_EQ(pairs, overlapsAlong(1, boxes)) << "step " << step;
        ASSERT_TRUE(std::is_sorted(list.endpoints().begin(), list.endpoints().end(),
                                   [](const auto& a, const auto& b) { return a.precedes(b); }));
    }
    EXPECT_GT(begins, 10000u);
    EXPECT_GT(ends, 10000u);
}

TEST(EndpointList, KeepsOrderWhenBatchesOfBoxesAreInsertedAndRemoved)
{
    SCOPED_TRACE("seed 2");
    Random random(2);
    std::vector<Aabb> boxes(200, kEmptyAabb);
    EndpointList list(2);
    for (int round = 0; round < 50; ++round)
    {
        std::vector<std::uint8_t> isLeaving(boxes.size(), 0);
        std::vector<std::uint32_t> coming;
        for (std::uint32_t row = 0; row < boxes.size(); ++row)
        {
            if (random.chance(0.7f))
                continue;
            if (isValid(boxes[row]))
            {
                isLeaving[row] = 1;
                boxes[row] = kEmptyAabb;
            }
            else
            {
                const float start = static_cast<float>(random.below(100));
                boxes[row] = cube(start, start + 3);
                coming.push_back(row);
            }
        }
        list.remove(isLeaving);
        list.insert(coming, boxes);
        const auto count =
            std::count_if(boxes.begin(), boxes.end(), [](const Aabb& box) { return isValid(box); });
        ASSERT_EQ(list.endpoints().size(), 2 * static_cast<std::size_t>(count));
        ASSERT_EQ(sweep(list), overlapsAlong(2, boxes)) << "round " << round;
    }
    EXPECT_EQ(list.swapsTotal(), 0u);
}

TEST(EndpointList, GivesPairsAndOpenSetsOfSlidesWhenSwept)
{
    const EndpointList x = listOf(0, kSlide);
    const EndpointList y = listOf(1, kSlide);
    std::vector<std::vector<std::uint32_t>> setsX, setsY;
    const Rows pairsX = sweep(x, &setsX);
    const Rows pairsY = sweep(y, &setsY);
    EXPECT_EQ(setsX,
              (std::vector<std::vector<std::uint32_t>>{{1}, {1, 3}, {1}, {1, 4}, {4}, {}, {5}, {}, {2}, {}}));
    EXPECT_EQ(setsY, (std::vector<std::vector<std::uint32_t>>{
                         {4}, {4, 1}, {4}, {4, 5}, {5}, {5, 2}, {5, 2, 3}, {2, 3}, {2}, {}}));
    EXPECT_EQ(pairsX, (Rows{{1, 3}, {1, 4}}));
    EXPECT_EQ(pairsY, (Rows{{1, 4}, {4, 5}, {2, 5}, {3, 5}, {2, 3}}));
    Rows both;
    std::set_intersection(pairsX.begin(), pairsX.end(), pairsY.begin(), pairsY.end(),
                          std::inserter(both, both.end()));
    EXPECT_EQ(both, (Rows{{1, 4}}));
}

TEST(EndpointList, ReportsOverlapWhenEndOfObjectFivePassesStartOfObjectTwo)
{
    EndpointList x = listOf(0, kSlide);
    Rows begun;
    x.move(5, translated(kSlide[5], 1.5f, 0, 0),
           [&](std::uint32_t other, EndpointEvent event)
           {
               EXPECT_EQ(event, EndpointEvent::OverlapBegins);
               begun.insert(std::minmax(5u, other));
           });
    EXPECT_EQ(begun, (Rows{{2, 5}}));
    EXPECT_EQ(x.swapsTotal(), 1u);
}

TEST(SapBackend, SwapsOnlyLimitsPassedByMovedBoxAndIdlesOtherwise)
{
    BackendSession session{makeSapBackend()};
    for (int i = 0; i < 100; ++i)
        session.add(boxAt(2.0f * static_cast<float>(i), static_cast<float>(i) / 1024, 0));
    ASSERT_TRUE(session.step());
    EXPECT_STREQ(session.backend().stats().path, "batch");
    ASSERT_TRUE(session.step());
    EXPECT_STREQ(session.backend().stats().path, "idle");
    // One box moves by less than the gap: it passes no limit on x; on y it passes the limits of the 49 higher boxes.
    session.table.setBox(50, boxAt(100.25f, 0.25f, 0));
    ASSERT_TRUE(session.step());
    EXPECT_STREQ(session.backend().stats().path, "incremental");
    const ComparisonStats stats = comparisonStatsOf(session.backend());
    EXPECT_EQ(stats.swaps[0], 0u);
    EXPECT_EQ(stats.swaps[1], 2u * 49);
    EXPECT_EQ(stats.swaps[2], 0u);
}

TEST(SapBackend, MakesMostSwapsOnAxisAlongWhichPileIsLayered)
{
    SCOPED_TRACE("seed 3");
    // Layers on y, each body at its own position on x and z; all jitter by the same amount on each axis.
    Random random(3);
    BackendSession session{makeSapBackend()};
    std::vector<Aabb> home;
    for (std::uint32_t i = 0; i < 500; ++i)
    {
        const float z = random.between(0, 12), x = random.between(0, 12);
        home.push_back(boxAt(x, static_cast<float>(i / 100), z));
        session.add(home.back());
    }
    ASSERT_TRUE(session.step());
    std::uint64_t swaps[3] = {0, 0, 0};
    for (int step = 0; step < 10; ++step)
    {
        for (std::uint32_t row = 0; row < home.size(); ++row)
            session.table.setBox(row, translated(home[row], random.point(-0.01f, 0.01f)));
        ASSERT_TRUE(session.step());
        for (int axis = 0; axis < 3; ++axis)
            swaps[axis] += comparisonStatsOf(session.backend()).swaps[axis];
    }
    EXPECT_GT(swaps[0], 1000u);
    EXPECT_GT(swaps[2], 1000u);
    EXPECT_GT(swaps[1], 20 * (swaps[0] + swaps[2]));
}
}  // namespace
}  // namespace cullet::test
