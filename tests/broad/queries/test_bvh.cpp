// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/queries/bvh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

namespace cullet
{
namespace
{
std::vector<ProxyId> firstRows(std::size_t count)
{
    std::vector<ProxyId> rows(count);
    std::iota(rows.begin(), rows.end(), 0u);
    return rows;
}

std::vector<Aabb> randomBoxes(std::size_t count, unsigned seed)
{
    std::mt19937 engine(seed);
    std::uniform_real_distribution<float> position(-100.0f, 100.0f);
    std::uniform_real_distribution<float> octave(-6.0f, 4.0f);
    std::vector<Aabb> boxes(count);
    for (Aabb& box : boxes)
    {
        const float half = std::exp2(octave(engine));
        for (int axis = 0; axis < 3; ++axis)
        {
            const float centre = position(engine);
            box.min[axis] = centre - half;
            box.max[axis] = centre + half;
        }
    }
    return boxes;
}

std::vector<ProxyId> find(const Bvh& tree, const Aabb& box)
{
    TreeCursor cursor;
    cursor.depth = 1;
    cursor.nodes[0] = 0;
    cursor.pending[0] = 1;
    std::vector<ProxyId> found;
    ProxyId rows[kQueryBatch];
    while (const std::uint32_t count = queryKernels(false).treeOverlap(tree.view(), box, cursor, rows))
        found.insert(found.end(), rows, rows + count);
    std::sort(found.begin(), found.end());
    return found;
}

/// Expects every row in one slot, and every node inside the lane of its parent.
void expectSound(const Bvh& tree, const std::vector<Aabb>& boxes)
{
    std::vector<int> seen(boxes.size(), 0);
    for (std::uint32_t slot = 0; slot < tree.slotCount(); ++slot)
    {
        if (tree.rowAt(slot) != kNoRow)
            ++seen[tree.rowAt(slot)];
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), tree.rowCount());
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 0),
              static_cast<std::ptrdiff_t>(boxes.size() - tree.rowCount()));
    const BoxTreeView& view = tree.view();
    for (int level = 0; level + 1 < view.levelCount; ++level)
    {
        const std::uint32_t count = static_cast<std::uint32_t>(view.levels[level + 1] - view.levels[level]);
        for (std::uint32_t index = 0; index < count; ++index)
        {
            const WideNode& node = view.levels[level][index];
            const WideNode& parent = view.levels[level + 1][index / 8];
            for (int axis = 0; axis < 3; ++axis)
            {
                EXPECT_EQ(*std::min_element(node.planes[axis], node.planes[axis] + 8),
                          parent.planes[axis][index % 8]);
                EXPECT_EQ(*std::max_element(node.planes[axis + 3], node.planes[axis + 3] + 8),
                          parent.planes[axis + 3][index % 8]);
            }
        }
    }
}

TEST(Bvh, HoldsEveryRowOnceForAnyCount)
{
    for (const std::size_t count : {0, 1, 7, 8, 9, 63, 64, 65, 511, 513, 4097, 20000})
    {
        SCOPED_TRACE(count);
        const std::vector<Aabb> boxes = randomBoxes(count, 21);
        Bvh tree;
        tree.build(boxes.data(), firstRows(count));
        EXPECT_EQ(tree.rowCount(), count);
        expectSound(tree, boxes);
    }
}

TEST(Bvh, HasDepthOfCompleteTreeWhateverTheBoxesAre)
{
    const std::size_t count = 50000;
    std::vector<Aabb> samePoint(count, Aabb{{1, 2, 3}, {1, 2, 3}});
    std::vector<Aabb> line(count);
    std::vector<Aabb> twoPlaces(count);
    for (std::size_t i = 0; i < count; ++i)
    {
        // A million times as long as wide, with exponential spacing, so that no grid could resolve the short end.
        const float x = std::exp2(static_cast<float>(i) / 2000.0f);
        line[i] = {{x, 0, 0}, {x * 1.0001f, 1e-3f, 1e-3f}};
        twoPlaces[i] = i % 2 == 0 ? Aabb{{0, 0, 0}, {1, 1, 1}} : Aabb{{1e12f, 0, 0}, {1e12f, 1, 1}};
    }
    for (const std::vector<Aabb>* boxes : {&samePoint, &line, &twoPlaces})
    {
        Bvh tree;
        tree.build(boxes->data(), firstRows(count));
        EXPECT_EQ(tree.view().levelCount, 6);  // 8^6 > 50,000 > 8^5
        expectSound(tree, *boxes);
    }
}

TEST(Bvh, KeepsEveryNodeTightAfterMovesAndRemovals)
{
    std::vector<Aabb> boxes = randomBoxes(3000, 22);
    Bvh tree;
    tree.build(boxes.data(), firstRows(boxes.size()));
    int moved = 0;
    for (std::uint32_t slot = 0; slot < tree.slotCount(); slot += 3)
    {
        const ProxyId row = tree.rowAt(slot);
        if (row == kNoRow)
            continue;
        if (row % 5 == 0)
        {
            tree.remove(slot);
            boxes[row] = kEmptyAabb;
            continue;
        }
        for (int axis = 0; axis < 3; ++axis)
        {
            boxes[row].min[axis] += 0.25f;
            boxes[row].max[axis] += 0.25f;
        }
        tree.move(slot, boxes[row]);
        ++moved;
    }
    EXPECT_GT(moved, 500);
    EXPECT_LT(tree.rowCount(), 2900u);
    expectSound(tree, boxes);
    std::vector<ProxyId> expected;
    const Aabb query = {{-20, -20, -20}, {20, 20, 20}};
    for (ProxyId row = 0; row < boxes.size(); ++row)
    {
        if (isValid(boxes[row]) && overlaps(boxes[row], query))
            expected.push_back(row);
    }
    EXPECT_GT(expected.size(), 20u);
    EXPECT_EQ(find(tree, query), expected);
}

TEST(Bvh, KeepsNeighboursOnRefitAndDropsFarAwayAndEmptyRows)
{
    std::vector<Aabb> boxes = randomBoxes(5000, 23);
    Bvh tree;
    tree.build(boxes.data(), firstRows(boxes.size()));
    for (std::size_t i = 0; i < boxes.size(); ++i)
    {
        boxes[i].min[0] += 0.01f;
        boxes[i].max[0] += 0.01f;
    }
    boxes[10] = {{1e6f, 0, 0}, {1e6f, 1, 1}};
    boxes[20] = kEmptyAabb;
    boxes[30].max[2] = 1e18f;
    std::vector<ProxyId> left;
    tree.refit(boxes.data(), left);
    std::sort(left.begin(), left.end());
    EXPECT_EQ(left, (std::vector<ProxyId>{10, 20, 30}));
    EXPECT_EQ(tree.rowCount(), boxes.size() - 3);
    expectSound(tree, boxes);
    EXPECT_NEAR(tree.leafArea(), tree.leafAreaAtBuild(), 0.1 * tree.leafAreaAtBuild());
}

TEST(Bvh, HoldsBoxInSlotOnlyWhenItLiesInsideAndFillsHalf)
{
    const std::vector<Aabb> boxes = {{{0, 0, 0}, {4, 4, 4}}};
    Bvh tree;
    tree.build(boxes.data(), firstRows(1));
    const std::uint32_t slot = 0;
    ASSERT_EQ(tree.rowAt(slot), 0u);
    EXPECT_TRUE(tree.holds(slot, boxes[0]));
    EXPECT_TRUE(tree.holds(slot, {{1, 0, 2}, {3, 4, 4}}));
    EXPECT_FALSE(tree.holds(slot, {{1, 0, 2}, {3, 4, 3.9f}})) << "less than half along z";
    EXPECT_FALSE(tree.holds(slot, {{0, 0, 0}, {4, 4.1f, 4}})) << "sticks out";
    EXPECT_FALSE(tree.holds(slot, kEmptyAabb));
}

TEST(Bvh, KeepsLeavesOfSmallBoxesTightBesideLargeOnes)
{
    std::vector<Aabb> boxes;
    for (int i = 0; i < 8000; ++i)
    {
        const float x = static_cast<float>(i % 20), y = static_cast<float>(i / 20 % 20),
                    z = static_cast<float>(i / 400);
        boxes.push_back({{x, y, z}, {x + 0.5f, y + 0.5f, z + 0.5f}});
    }
    Bvh smallOnly;
    smallOnly.build(boxes.data(), firstRows(boxes.size()));
    for (int i = 0; i < 800; ++i)
        boxes.push_back({{-100, -100, -100}, {100, 100, 100}});
    Bvh both;
    both.build(boxes.data(), firstRows(boxes.size()));
    const double largeLeaves = 100.0 * 3.0 * 200.0 * 200.0;
    EXPECT_LT(both.leafArea(), 1.1 * (smallOnly.leafArea() + largeLeaves));
}
}  // namespace
}  // namespace cullet
