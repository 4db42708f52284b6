// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/cuda/host/host_exec.h"
#include "cullet/mid/linear_bvh.h"
#include "cullet/tests/mid/test_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace cullet::test
{
namespace
{
using psap::HostExec;
using ItemPairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

PsapOptions executorOf(PsapExecutor executor)
{
    PsapOptions options;
    options.executor = executor;
    options.threads = 3;
    return options;
}

ItemPairs pairsByBruteForce(const std::vector<MeshBox>& queries, const std::vector<MeshBox>& boxes)
{
    ItemPairs pairs;
    for (std::uint32_t i = 0; i < queries.size(); ++i)
    {
        for (std::uint32_t k = 0; k < boxes.size(); ++k)
        {
            if (isValid(boxes[k]) && overlap(queries[i], boxes[k]))
                pairs.emplace_back(i, k);
        }
    }
    return pairs;
}

/// A tree with its executor.
struct Bench
{
    explicit Bench(PsapExecutor executor) : exec(executorOf(executor)), tree(exec) {}

    ItemPairs pairsOf(const std::vector<MeshBox>& queries)
    {
        std::vector<RowPair> found(1000000);
        std::uint64_t count = 0;
        tree.findOverlaps(queries.data(), static_cast<std::uint32_t>(queries.size()),
                          psap::PairList{found.data(), found.size(), &count});
        EXPECT_LE(count, found.size());
        ItemPairs pairs;
        for (std::uint64_t i = 0; i < count; ++i)
            pairs.emplace_back(found[i].a, found[i].b);
        std::sort(pairs.begin(), pairs.end());
        return pairs;
    }

    std::vector<MeshBox> nodeBoxes() const
    {
        return {tree.nodeBoxes(), tree.nodeBoxes() + (tree.size() == 0 ? 0 : 2 * tree.size() - 1)};
    }

    HostExec exec;
    LinearBvh<HostExec> tree;
};

constexpr MeshBox kBounds = {{-10, -10, -10}, {10, 10, 10}};
constexpr PsapExecutor kExecutors[] = {PsapExecutor::InOrder, PsapExecutor::Shuffled, PsapExecutor::Threads};

class LinearBvhOfKind : public testing::TestWithParam<std::string>
{
};

TEST_P(LinearBvhOfKind, FindsPairsOfBruteForceAlsoAfterRefit)
{
    constexpr unsigned kSeed = 17;
    Random random(kSeed);
    Mesh mesh = makeMesh(GetParam(), random);
    std::vector<MeshBox> queries = boxesOf(makeMesh("random", random));
    queries.resize(300);
    const std::vector<MeshBox> boxes = boxesOf(mesh);
    const ItemPairs expected = pairsByBruteForce(queries, boxes);
    for (const PsapExecutor executor : kExecutors)
    {
        SCOPED_TRACE(static_cast<int>(executor));
        Bench bench(executor);
        bench.tree.build(boxes.data(), static_cast<std::uint32_t>(boxes.size()), kBounds);
        EXPECT_EQ(bench.pairsOf(queries), expected) << "seed " << kSeed;
        EXPECT_TRUE(boxes.size() < 2 || expected.size() > 100);

        std::vector<MeshBox> moved = boxes;
        for (MeshBox& box : moved)
        {
            const float by = 3.0f * (box.min[0] - box.min[1]);
            box.min[2] += by;
            box.max[2] += by;
        }
        bench.tree.refit(moved.data());
        const ItemPairs expectedMoved = pairsByBruteForce(queries, moved);
        EXPECT_EQ(bench.pairsOf(queries), expectedMoved) << "seed " << kSeed;
        EXPECT_TRUE(boxes.size() < 2 || expectedMoved != expected);
    }
}

INSTANTIATE_TEST_SUITE_P(All, LinearBvhOfKind, testing::ValuesIn(meshKinds()));

TEST(LinearBvh, HasTheSameBitsWithAnyExecutor)
{
    Random random(18);
    const std::vector<MeshBox> boxes = boxesOf(makeMesh("duplicated", random));
    std::vector<MeshBox> expected;
    for (const PsapExecutor executor : kExecutors)
    {
        Bench bench(executor);
        bench.tree.build(boxes.data(), static_cast<std::uint32_t>(boxes.size()), kBounds);
        const std::vector<MeshBox> found = bench.nodeBoxes();
        ASSERT_EQ(found.size(), 2 * boxes.size() - 1);
        if (expected.empty())
            expected = found;
        EXPECT_EQ(std::memcmp(found.data(), expected.data(), found.size() * sizeof(MeshBox)), 0);
    }
}

TEST(LinearBvh, FindsAllPairsWhenCentresAreOutsideOfItsBoundsOrInfinite)
{
    Random random(19);
    std::vector<MeshBox> boxes = boxesOf(makeMesh("random", random));
    const float infinity = std::numeric_limits<float>::infinity();
    boxes[5] = {{-infinity, -1, -1}, {infinity, 1, 1}};
    std::vector<MeshBox> queries = boxesOf(makeMesh("random", random));
    queries.resize(300);
    for (const MeshBox& bounds : {MeshBox{{-1, -1, -1}, {1, 1, 1}}, MeshBox{{2, 2, 2}, {2, 2, 2}}})
    {
        Bench bench(PsapExecutor::InOrder);
        bench.tree.build(boxes.data(), static_cast<std::uint32_t>(boxes.size()), bounds);
        EXPECT_EQ(bench.pairsOf(queries), pairsByBruteForce(queries, boxes));
    }
}

TEST(LinearBvh, TestsFewBoxesWhereFewOverlap)
{
    Random random(20);
    std::vector<MeshBox> boxes;
    for (int i = 0; i < 5000; ++i)
    {
        const Triangle triangle = randomTriangle(random, 10.0f, 0.2f);
        boxes.push_back(boxOfTriangle(triangle.data(), 0.0));
    }
    Bench bench(PsapExecutor::InOrder);
    bench.tree.build(boxes.data(), static_cast<std::uint32_t>(boxes.size()), kBounds);
    bench.exec.collectTestCount();
    const ItemPairs pairs = bench.pairsOf(boxes);
    EXPECT_EQ(pairs, pairsByBruteForce(boxes, boxes));
    EXPECT_LT(bench.exec.collectTestCount(), 100u * boxes.size());
}
}  // namespace
}  // namespace cullet::test
