// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/base/threads/parallel_loops.h"
#include "cullet/mid/mesh_tree.h"
#include "cullet/tests/mid/test_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

namespace cullet::test
{
namespace
{
using Items = std::vector<std::uint32_t>;

struct Segment
{
    Point from;
    Point motion;
};

SweptBox sweptBox(const Segment& segment, double half)
{
    SweptBox box;
    for (int axis = 0; axis < 3; ++axis)
    {
        const auto i = static_cast<std::size_t>(axis);
        box.origin[axis] = segment.from[i];
        box.motion[axis] = segment.motion[i];
        box.min[axis] = -half;
        box.max[axis] = half;
    }
    return box;
}

/// Rays through the mesh, mostly from outside of it; some along an axis and some of no length.
Segment randomSegment(Random& random)
{
    const Point from = randomPoint(random, 15.0f), towards = randomPoint(random, 8.0f);
    Segment segment = {from, towards - from};
    for (double& coordinate : segment.motion)
        coordinate *= 1.5;
    if (random.chance(0.2f))
    {
        const std::size_t axis = random.below(3);
        segment.motion[axis] = 0.0;
        segment.motion[(axis + 1) % 3] = random.chance(0.1f) ? 0.0 : 1e-7;
    }
    return segment;
}

/// Whether a swept box touches a box, in double: the share at which it does, or nothing.
std::optional<double> touch(const SweptBox& query, const MeshBox& box)
{
    double enter = 0.0, leave = 1.0;
    for (int axis = 0; axis < 3; ++axis)
    {
        const double low = box.min[axis] - query.max[axis] - query.origin[axis];
        const double high = box.max[axis] - query.min[axis] - query.origin[axis];
        const double motion = query.motion[axis];
        if (motion == 0.0)
        {
            if (low > 0.0 || high < 0.0)
                return std::nullopt;
            continue;
        }
        enter = std::max(enter, std::min(low / motion, high / motion));
        leave = std::min(leave, std::max(low / motion, high / motion));
    }
    return enter <= leave ? std::optional<double>(enter) : std::nullopt;
}

/// What a tree finds on a path; without a result if it refuses the path.
std::optional<Items> itemsOnPath(const MeshTree& tree, const SweptBox& query)
{
    std::vector<MeshCandidate> found;
    if (!tree.findOnPath(query, 1.0, found))
        return std::nullopt;
    Items items;
    for (const MeshCandidate& candidate : found)
        items.push_back(candidate.item);
    return items;
}

/// A tree over a mesh of some kind, and the plain loops to compare it with.
class MeshTreeOfKind : public testing::TestWithParam<std::string>
{
protected:
    static constexpr std::uint32_t kSeed = 4107;

    MeshTreeOfKind() : random(kSeed), mesh(makeMesh(GetParam(), random)), boxes(boxesOf(mesh))
    {
        tree.build(boxes.data(), static_cast<std::uint32_t>(boxes.size()), nullptr);
    }

    bool hasTriangles() const { return mesh.size() > 1; }

    Random random;
    Mesh mesh;
    std::vector<MeshBox> boxes;
    MeshTree tree;
};

TEST_P(MeshTreeOfKind, FindsOverlapsOfPlainLoopInOrder)
{
    std::size_t total = 0;
    for (int i = 0; i < 300; ++i)
    {
        const Point centre = randomPoint(random, 11.0f);
        const double half = random.logUniform(-4, 3);
        MeshBox query;
        for (std::size_t axis = 0; axis < 3; ++axis)
        {
            query.min[axis] = static_cast<float>(centre[axis] - half);
            query.max[axis] = static_cast<float>(centre[axis] + half);
        }
        Items expected;
        for (std::uint32_t item = 0; item < boxes.size(); ++item)
        {
            if (isValid(boxes[item]) && overlap(boxes[item], query))
                expected.push_back(item);
        }
        Items found;
        tree.findOverlaps(query, found);
        ASSERT_EQ(found, expected) << "seed " << kSeed << ", query " << i;
        total += found.size();
    }
    if (hasTriangles())
    {
        EXPECT_GT(total, 1000u);
    }
}

TEST_P(MeshTreeOfKind, FindsEveryItemOnPathAndFewOthers)
{
    std::size_t touched = 0, found = 0;
    for (int i = 0; i < 500; ++i)
    {
        const double half = random.chance(0.5f) ? 0.0 : random.logUniform(-5, 1);
        const SweptBox query = sweptBox(randomSegment(random), half);
        const std::optional<Items> result = itemsOnPath(tree, query);
        ASSERT_TRUE(result);
        const Items& items = *result;
        ASSERT_TRUE(std::is_sorted(items.begin(), items.end()));
        ASSERT_EQ(std::adjacent_find(items.begin(), items.end()), items.end());
        found += items.size();
        for (std::uint32_t item = 0; item < boxes.size(); ++item)
        {
            if (!isValid(boxes[item]) || !touch(query, boxes[item]))
                continue;
            ++touched;
            ASSERT_TRUE(std::binary_search(items.begin(), items.end(), item))
                << "seed " << kSeed << ", query " << i << ", item " << item;
        }
    }
    EXPECT_LE(found, touched + touched / 1000 + 2);
    if (hasTriangles())
    {
        EXPECT_GT(touched, 2500u);
    }
}

TEST_P(MeshTreeOfKind, FindsClosestCrossingOfPlainLoop)
{
    int hits = 0;
    for (int i = 0; i < 2000; ++i)
    {
        const Segment segment = randomSegment(random);
        double expected = 1.0, closest = 1.0;
        for (const Triangle& triangle : mesh)
            expected = std::min(expected, crossing(triangle, segment.from, segment.motion).value_or(1.0));
        const auto test = [&](const MeshCandidate& candidate)
        {
            closest =
                std::min(closest, crossing(mesh[candidate.item], segment.from, segment.motion).value_or(1.0));
            return closest;
        };
        ASSERT_TRUE(tree.visitByEntry(sweptBox(segment, 0.0), 1.0, test));
        ASSERT_EQ(closest, expected) << "seed " << kSeed << ", ray " << i;
        hits += closest < 1.0 ? 1 : 0;
    }
    if (hasTriangles() && GetParam() != "needles")
    {
        EXPECT_GT(hits, 150);
    }
}

TEST_P(MeshTreeOfKind, FindsAllCrossingsOfPlainLoopInOrder)
{
    std::size_t total = 0;
    for (int i = 0; i < 1000; ++i)
    {
        const Segment segment = randomSegment(random);
        Items expected, found;
        for (std::uint32_t item = 0; item < mesh.size(); ++item)
        {
            if (crossing(mesh[item], segment.from, segment.motion))
                expected.push_back(item);
        }
        const std::optional<Items> items = itemsOnPath(tree, sweptBox(segment, 0.0));
        ASSERT_TRUE(items);
        for (const std::uint32_t item : *items)
        {
            if (crossing(mesh[item], segment.from, segment.motion))
                found.push_back(item);
        }
        ASSERT_EQ(found, expected) << "seed " << kSeed << ", ray " << i;
        total += found.size();
    }
    if (hasTriangles() && GetParam() != "needles")
    {
        EXPECT_GT(total, 200u);
    }
}

TEST_P(MeshTreeOfKind, VisitsItemsUpToLimit)
{
    std::size_t visited = 0, all = 0;
    for (int i = 0; i < 300; ++i)
    {
        const SweptBox query = sweptBox(randomSegment(random), 0.5);
        const double limit = random.unit();
        Items items;
        ASSERT_TRUE(tree.visitByEntry(query, limit,
                                      [&](const MeshCandidate& candidate)
                                      {
                                          items.push_back(candidate.item);
                                          return limit;
                                      }));
        for (std::uint32_t item = 0; item < boxes.size(); ++item)
        {
            if (!isValid(boxes[item]))
                continue;
            const std::optional<double> enter = touch(query, boxes[item]);
            all += enter ? 1 : 0;
            const bool isVisited = std::find(items.begin(), items.end(), item) != items.end();
            ASSERT_TRUE(isVisited || !enter || *enter > limit) << "seed " << kSeed << ", query " << i;
            ASSERT_TRUE(!isVisited || !enter || *enter <= limit * 1.00001);
        }
        visited += items.size();
    }
    if (hasTriangles())
    {
        EXPECT_LT(visited, all * 19 / 20);
    }
}

TEST_P(MeshTreeOfKind, FindsSameItemsWithBaselineKernels)
{
    MeshTree baseline(meshKernels(true));
    baseline.build(boxes.data(), static_cast<std::uint32_t>(boxes.size()), nullptr);
    for (int i = 0; i < 300; ++i)
    {
        const SweptBox query = sweptBox(randomSegment(random), random.unit());
        Items byOne, byOther;
        ASSERT_EQ(itemsOnPath(tree, query), itemsOnPath(baseline, query));
        const auto collectInto = [](Items& items)
        {
            return [&items](const MeshCandidate& candidate)
            {
                items.push_back(candidate.item);
                return 1.0;
            };
        };
        ASSERT_TRUE(tree.visitByEntry(query, 1.0, collectInto(byOne)));
        ASSERT_TRUE(baseline.visitByEntry(query, 1.0, collectInto(byOther)));
        ASSERT_EQ(byOne, byOther);
    }
}

TEST_P(MeshTreeOfKind, FindsMovedItemsAfterRefit)
{
    for (Triangle& triangle : mesh)
    {
        const Point offset = randomPoint(random, 2.0f);
        for (Point& corner : triangle)
        {
            for (std::size_t axis = 0; axis < 3; ++axis)
                corner[axis] += offset[axis];
        }
    }
    boxes = boxesOf(mesh);
    tree.refit(boxes.data(), nullptr);
    for (int i = 0; i < 100; ++i)
    {
        const SweptBox query = sweptBox(randomSegment(random), 0.25);
        const std::optional<Items> items = itemsOnPath(tree, query);
        ASSERT_TRUE(items);
        for (std::uint32_t item = 0; item < boxes.size(); ++item)
        {
            const bool isTouched = isValid(boxes[item]) && touch(query, boxes[item]);
            ASSERT_TRUE(!isTouched || std::binary_search(items->begin(), items->end(), item));
        }
    }
}

INSTANTIATE_TEST_SUITE_P(All, MeshTreeOfKind, testing::ValuesIn(meshKinds()),
                         [](const auto& kind) { return kind.param; });

bool areEqual(const MeshTree& a, const MeshTree& b)
{
    const MeshTreeView &x = a.view(), &y = b.view();
    if (x.levelCount != y.levelCount || a.bytes() != b.bytes())
        return false;
    std::size_t leaves = 0, nodes = 0;
    for (int level = 0; level + 1 < x.levelCount; ++level)
    {
        const auto count = static_cast<std::size_t>(x.levels[level + 1] - x.levels[level]);
        leaves = level == 0 ? count : leaves;
        nodes += count;
    }
    return std::memcmp(x.levels[0], y.levels[0], (nodes + 1) * sizeof(WideNode)) == 0 &&
           std::memcmp(x.items, y.items, 8 * leaves * sizeof(std::uint32_t)) == 0;
}

TEST(MeshTree, IsSameForAnyNumberOfThreads)
{
    Random random(4108);
    Mesh mesh;
    for (int i = 0; i < 100000; ++i)
        mesh.push_back(randomTriangle(random, 100.0f, random.logUniform(-6, 4)));
    std::vector<MeshBox> boxes = boxesOf(mesh);
    const auto count = static_cast<std::uint32_t>(boxes.size());
    MeshTree one;
    one.build(boxes.data(), count, nullptr);
    std::vector<MeshBox> moved = boxes;
    std::rotate(moved.begin(), moved.begin() + 1, moved.end());
    MeshTree refitted;
    refitted.build(boxes.data(), count, nullptr);
    refitted.refit(moved.data(), nullptr);
    ASSERT_FALSE(areEqual(one, refitted));
    for (const int threads : {2, 3, 8})
    {
        ParallelLoops loops(threads);
        MeshTree tree;
        tree.build(boxes.data(), count, &loops);
        EXPECT_TRUE(areEqual(one, tree)) << threads << " threads";
        tree.refit(moved.data(), &loops);
        EXPECT_TRUE(areEqual(refitted, tree)) << threads << " threads";
    }
}

TEST(MeshTree, TakesAtMost32BytesPerTriangle)
{
    Random random(4109);
    Mesh mesh;
    for (int i = 0; i < 100000; ++i)
        mesh.push_back(randomTriangle(random, 100.0f, 0.5f));
    const std::vector<MeshBox> boxes = boxesOf(mesh);
    MeshTree tree;
    tree.build(boxes.data(), static_cast<std::uint32_t>(boxes.size()), nullptr);
    EXPECT_LE(tree.bytes(), 32u * boxes.size());
}

TEST(MeshTree, FindsNothingWhenAllBoxesAreEmpty)
{
    const std::vector<MeshBox> boxes(100, kEmptyMeshBox);
    MeshTree tree;
    tree.build(boxes.data(), 100, nullptr);
    const float infinity = std::numeric_limits<float>::infinity();
    Items items;
    tree.findOverlaps({{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}}, items);
    EXPECT_TRUE(items.empty());
}

TEST(MeshTree, FindsAllValidItemsInInfiniteBox)
{
    std::vector<MeshBox> boxes(100, MeshBox{{1, 1, 1}, {2, 2, 2}});
    for (std::size_t i = 0; i < boxes.size(); i += 3)
        boxes[i] = kEmptyMeshBox;
    MeshTree tree;
    tree.build(boxes.data(), 100, nullptr);
    const float infinity = std::numeric_limits<float>::infinity();
    Items items;
    tree.findOverlaps({{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}}, items);
    EXPECT_EQ(items.size(), 66u);
}

TEST(MeshTree, RefusesPathThatIsNotFinite)
{
    const std::vector<MeshBox> boxes(100, MeshBox{{1, 1, 1}, {2, 2, 2}});
    MeshTree tree;
    tree.build(boxes.data(), 100, nullptr);
    const SweptBox query = sweptBox({{std::nan(""), 0, 0}, {1, 0, 0}}, 0.0);
    EXPECT_FALSE(itemsOnPath(tree, query));
    EXPECT_FALSE(tree.visitByEntry(query, 1.0,
                                   [](const MeshCandidate&)
                                   {
                                       ADD_FAILURE();
                                       return 1.0;
                                   }));
}
}  // namespace
}  // namespace cullet::test
