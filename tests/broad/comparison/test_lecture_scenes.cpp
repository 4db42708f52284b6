// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The worked scenes of Lesson 04, Broad Phase, with coordinates that give the slides' cells and orders. The slides are
// two-dimensional; here every box is one unit deep.

#include "cullet/comparison/cell_grid.h"
#include "cullet/comparison/uniform_grid.h"
#include "cullet/tests/broad/conformance/backend_cases.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/boxes.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
using Names = std::set<std::pair<char, char>>;

Aabb flat(float minX, float maxX, float minY, float maxY)
{
    return {{minX, minY, 0}, {maxX, maxY, 0.0625f}};
}

/// "Uniform Grid - Principle": five objects, cell size 1.
const std::vector<std::pair<char, Aabb>> kUniformScene = {
    {'1', flat(1.25f, 2.5f, 1.25f, 2.5f)},    {'2', flat(0.5f, 1.375f, 2.125f, 2.75f)},
    {'3', flat(4.25f, 4.75f, 3.25f, 3.75f)},  {'4', flat(2.25f, 3.5f, 0.5f, 1.375f)},
    {'5', flat(3.25f, 3.875f, 0.25f, 0.75f)},
};

/// "Hierarchical Uniform Grid - Principle": A and B share a cell of B's grid, D, E and F one of F's; C is alone.
const std::vector<std::pair<char, Aabb>> kHierarchicalScene = {
    {'A', flat(0.25f, 0.4375f, 0.25f, 0.4375f)},        // 0.1875: resolution 2
    {'B', flat(0.25f, 0.9375f, 0.3125f, 0.9375f)},      // 0.6875: resolution 0
    {'C', flat(3.0f, 3.125f, 3.0f, 3.125f)},            // 0.125: resolution 3
    {'D', flat(2.03125f, 2.125f, 0.03125f, 0.125f)},    // 0.09375: resolution 3
    {'E', flat(2.3125f, 2.40625f, 0.3125f, 0.40625f)},  // 0.09375: resolution 3
    {'F', flat(2.0625f, 2.4375f, 0.0625f, 0.4375f)},    // 0.375: resolution 1
};

/// "SAP - Algorithm Principle": orders on x 1 3 3' 4 1' 4' 5 5' 2 2' and on y 4 1 1' 5 4' 2 3 5' 3' 2' (' = max).
std::vector<Aabb> sweepAndPruneScene()
{
    return {flat(0, 4, 1, 2), flat(8, 9, 5, 9), flat(1, 2, 6, 8), flat(3, 5, 0, 4), flat(6, 7, 3, 7)};
}

TEST(LectureScenes, ShareUniformGridCellsExactlyForPairsOfSlide)
{
    UniformGrid grid(0);
    for (std::uint32_t row = 0; row < 5; ++row)
        grid.addBox(row, kUniformScene[row].second);
    Names sharing;
    Names overlapping;
    for (std::uint32_t row = 0; row < 5; ++row)
    {
        grid.forEachSharing(row, false,
                            [&](std::uint32_t other)
                            {
                                const auto names =
                                    std::minmax(kUniformScene[row].first, kUniformScene[other].first);
                                sharing.insert(names);
                                if (overlaps(kUniformScene[row].second, kUniformScene[other].second))
                                    overlapping.insert(names);
                            });
    }
    const Names expected = {{'1', '2'}, {'1', '4'}, {'4', '5'}};
    EXPECT_EQ(sharing, expected);
    EXPECT_EQ(overlapping, expected);
}

TEST(LectureScenes, GetResolutionsOfSlideFromHierarchicalGrid)
{
    CellGrid grid;
    const std::map<char, int> resolutions = {{'A', 2}, {'B', 0}, {'C', 3}, {'D', 3}, {'E', 3}, {'F', 1}};
    for (const auto& [name, box] : kHierarchicalScene)
        EXPECT_EQ(-grid.levelOf(box), resolutions.at(name)) << name;
}

TEST(LectureScenes, PairBoldIdsButNotRegularOnesInCoarseCell)
{
    CellGrid grid;
    for (std::uint32_t row = 0; row < 6; ++row)
        grid.addBox(row, kHierarchicalScene[row].second);

    // The cell of F in its own grid, size 0.5, holds F bold and D and E regular.
    std::map<char, UniformGrid::Mark> content;
    const std::int32_t cell[3] = {4, 0, 0};
    grid.grid(-1)->forEachInCell(cell, [&](std::uint32_t row, UniformGrid::Mark mark)
                                 { content[kHierarchicalScene[row].first] = mark; });
    const std::map<char, UniformGrid::Mark> expectedContent = {
        {'D', UniformGrid::Mark::Regular}, {'E', UniformGrid::Mark::Regular}, {'F', UniformGrid::Mark::Bold}};
    EXPECT_EQ(content, expectedContent);

    std::map<std::pair<char, char>, int> reported;
    for (std::uint32_t row = 0; row < 6; ++row)
    {
        grid.forEachNeighbour(
            row, [&](std::uint32_t other)
            { ++reported[std::minmax(kHierarchicalScene[row].first, kHierarchicalScene[other].first)]; });
    }
    const std::map<std::pair<char, char>, int> expected = {{{'A', 'B'}, 2}, {{'D', 'F'}, 2}, {{'E', 'F'}, 2}};
    EXPECT_EQ(reported, expected) << "once from either side; D-E is not a pair";
}

class LectureScenesOnBackends : public BackendTest
{
protected:
    BackendSession session{GetParam().make()};
};

CULLET_ON_EVERY_BACKEND(LectureScenesOnBackends);

TEST_P(LectureScenesOnBackends, GivePairsOfUniformGridSlide)
{
    for (const auto& [name, box] : kUniformScene)
        session.add(box);
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 2}, {1, 4}, {4, 5}}, {}));
}

TEST_P(LectureScenesOnBackends, GivePairsOfHierarchicalGridSlide)
{
    for (const auto& [name, box] : kHierarchicalScene)
        session.add(box);
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 2}, {4, 6}, {5, 6}}, {}));
}

TEST_P(LectureScenesOnBackends, GivePairsOfSweepAndPruneSlideAndItsIncrementalUpdate)
{
    for (const Aabb& box : sweepAndPruneScene())
        session.add(box);
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 4}}, {}));
    // Object 5 moves right: its end limit, the eighth on x, passes the ninth, the start of object 2.
    session.table.setBox(4, translated(sweepAndPruneScene()[4], 1.5f, 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{2, 5}}, {}));
    // It moves back left.
    session.table.setBox(4, sweepAndPruneScene()[4]);
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {{2, 5}}));
}
}  // namespace
}  // namespace cullet::test
