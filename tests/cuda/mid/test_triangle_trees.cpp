// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Trees of triangles on the CPU's executor: the steps of the device, in shuffled order, against mid/'s tree.

#include "cullet/cuda/host/host_exec.h"
#include "cullet/cuda/mid/triangle_searches.h"
#include "cullet/tests/cuda/support/triangle_check.h"

#include <gtest/gtest.h>

#include <string>
#include <tuple>

namespace cullet::test
{
namespace
{
/// Two trees on the CPU's executor.
class HostTriangles
{
public:
    explicit HostTriangles(PsapExecutor order) : m_exec(optionsFor(order)), m_searches(m_exec, 2) {}

    void build(std::uint32_t tree, const TriangleMesh& mesh) { m_searches.build(tree, keep(tree, mesh)); }
    void refit(std::uint32_t tree, const TriangleMesh& mesh) { m_searches.refit(tree, keep(tree, mesh)); }
    TrianglePairList pairs(std::uint32_t a, std::uint32_t b)
    {
        m_searches.launchPairs(a, b);
        return collected();
    }
    TrianglePairList ownPairs(std::uint32_t tree, OwnPairs which)
    {
        m_searches.launchOwnPairs(tree, which);
        return collected();
    }
    std::uint64_t invalid() const { return m_invalid; }

    TrianglePairList collected()
    {
        const DeviceTrianglePairs found = m_searches.collect();
        m_invalid = found.invalid;
        TrianglePairList pairs;
        for (std::uint64_t i = 0; i < found.count; ++i)
            pairs.push_back({found.pairs[i].a, found.pairs[i].b});
        return pairs;
    }
    triangles::TriangleSearches<psap::HostExec>& searches() { return m_searches; }

private:
    static PsapOptions optionsFor(PsapExecutor order)
    {
        PsapOptions options;
        options.executor = order;
        options.threads = 3;
        return options;
    }

    /// A copy that lives as long as the tree.
    DeviceTriangles keep(std::uint32_t tree, const TriangleMesh& mesh)
    {
        TriangleMesh& own = m_meshes[tree % 4];
        own = mesh;
        return own.at(own.vertices.data(), own.indices.data());
    }

    psap::HostExec m_exec;
    triangles::TriangleSearches<psap::HostExec> m_searches;
    std::array<TriangleMesh, 4> m_meshes;
    std::uint64_t m_invalid = 0;
};

class TriangleTrees : public testing::TestWithParam<std::tuple<std::string, PsapExecutor>>
{
protected:
    const std::string& kind() const { return std::get<0>(GetParam()); }
    PsapExecutor order() const { return std::get<1>(GetParam()); }
};

TEST_P(TriangleTrees, FindPairsOfMeshTreeWhenMeshesDeform)
{
    const unsigned seed = 61;
    SCOPED_TRACE("seed " + std::to_string(seed));
    TriangleScene scene(kind(), 24, seed);
    HostTriangles trees(order());
    checkDeformation(trees, scene);
    if (kind() != "pile")
        expectRepresentative(scene);
}

INSTANTIATE_TEST_SUITE_P(Host, TriangleTrees,
                         testing::Combine(testing::ValuesIn(triangleKinds()),
                                          testing::Values(PsapExecutor::InOrder, PsapExecutor::Shuffled,
                                                          PsapExecutor::Threads)));

TEST(TriangleTreesOfFew, FindPairsOfEmptyAndSingleMeshes)
{
    HostTriangles trees(PsapExecutor::Shuffled);
    checkSmallMeshes(trees);
}

TEST(TriangleTreesOfInvalid, FindTrianglesAgainWhenRepaired)
{
    TriangleScene scene("sheets", 20, 62);
    HostTriangles trees(PsapExecutor::Shuffled);
    checkRepair(trees, scene);
}

TEST(TriangleTreesOfExtremes, FindPairsOfMeshTree)
{
    HostTriangles trees(PsapExecutor::Shuffled);
    checkExtremes(trees);
}

TEST(TriangleTreesOfMany, FindMorePairsThanTheListHasRoomFor)
{
    TriangleScene scene("pile", 24, 64);
    HostTriangles trees(PsapExecutor::Shuffled);
    trees.build(0, scene.a);
    const std::uint64_t size = scene.a.size();
    EXPECT_EQ(trees.ownPairs(0, OwnPairs::All).size(), size * (size - 1) / 2);
}

TEST(TriangleTreesOfMany, RefuseTwoToThe31Triangles)
{
    HostTriangles trees(PsapExecutor::InOrder);
    DeviceTriangles mesh;
    mesh.triangleCount = 0x80000000u;
    EXPECT_THROW(trees.searches().build(0, mesh), psap::ExecutorFailure);
    trees.searches().forget();
    EXPECT_EQ(trees.pairs(0, 0), TrianglePairList());
}

TEST(TriangleSearches, KeepPairsOfMeshesAsTheyWereWhenLaunched)
{
    TriangleScene scene("pile", 24, 65);
    HostTriangles trees(PsapExecutor::InOrder);
    trees.build(0, scene.a);
    trees.searches().launchOwnPairs(0, OwnPairs::All);
    const TrianglePairList expected = ownPairsByMeshTree(scene.a, OwnPairs::All);
    // The list was too short, and is made longer before the mesh changes.
    TriangleScene other("soup", 24, 65);
    trees.build(0, other.a);
    EXPECT_EQ(trees.collected(), expected);
    EXPECT_EQ(trees.ownPairs(0, OwnPairs::All), ownPairsByMeshTree(other.a, OwnPairs::All));
}

TEST(TriangleSearches, FindNothingWhenForgotten)
{
    TriangleScene scene("soup", 10, 66);
    HostTriangles trees(PsapExecutor::InOrder);
    trees.build(0, scene.a);
    trees.build(1, scene.b);
    const TrianglePairList before = trees.pairs(0, 1);
    EXPECT_GT(before.size(), 10u);
    trees.searches().forget();
    EXPECT_EQ(trees.collected(), TrianglePairList());
    EXPECT_EQ(trees.pairs(0, 1), TrianglePairList());
    trees.refit(0, scene.a);
    trees.refit(1, scene.b);
    EXPECT_EQ(trees.pairs(0, 1), before);
}
}  // namespace
}  // namespace cullet::test
