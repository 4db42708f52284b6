// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Trees of triangles on a device: the pairs of mid/'s tree, in the same order.

#include "cullet/cuda/mid/triangle_trees.h"
#include "cullet/tests/cuda/support/cuda_pairs.h"
#include "cullet/tests/cuda/support/failing_calls.h"
#include "cullet/tests/cuda/support/triangle_check.h"

#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// Two trees on a device, with meshes from the CPU.
class CudaTriangles
{
public:
    explicit CudaTriangles(CUstream_st* stream = nullptr)
        : m_trees(makeDeviceTriangleTrees(2, 0, stream, &why))
    {
    }

    bool isThere() const { return m_trees != nullptr; }

    DeviceTriangles upload(std::uint32_t tree, const TriangleMesh& mesh)
    {
        m_vertices[tree % 4].upload(mesh.vertices);
        m_indices[tree % 4].upload(mesh.indices);
        return mesh.at(m_vertices[tree % 4].data(), m_indices[tree % 4].data());
    }
    void build(std::uint32_t tree, const TriangleMesh& mesh)
    {
        EXPECT_EQ(m_trees->build(tree, upload(tree, mesh)), Status::Ok);
    }
    void refit(std::uint32_t tree, const TriangleMesh& mesh)
    {
        EXPECT_EQ(m_trees->refit(tree, upload(tree, mesh)), Status::Ok);
    }
    TrianglePairList pairs(std::uint32_t a, std::uint32_t b)
    {
        EXPECT_EQ(m_trees->enqueuePairs(a, b), Status::Ok);
        return collected();
    }
    TrianglePairList ownPairs(std::uint32_t tree, OwnPairs which)
    {
        EXPECT_EQ(m_trees->enqueueOwnPairs(tree, which), Status::Ok);
        return collected();
    }
    std::uint64_t invalid() const { return m_invalid; }

    TrianglePairList collected()
    {
        TrianglePairList pairs;
        EXPECT_EQ(collect(pairs), Status::Ok);
        return pairs;
    }
    Status collect(TrianglePairList& pairs)
    {
        DeviceTrianglePairs found;
        const Status status = m_trees->collect(found);
        m_invalid = found.invalid;
        pairs.clear();
        for (const RowPair& pair : downloaded(found.pairs, found.count))
            pairs.push_back({pair.a, pair.b});
        return status;
    }
    DeviceTriangleTrees& trees() { return *m_trees; }

    std::string why;

private:
    std::unique_ptr<DeviceTriangleTrees> m_trees;
    DeviceArray<float> m_vertices[4];
    DeviceArray<std::uint32_t> m_indices[4];
    std::uint64_t m_invalid = 0;
};

class CudaTriangleTrees : public testing::TestWithParam<std::string>
{
};

TEST_P(CudaTriangleTrees, FindPairsOfMeshTreeWhenMeshesDeform)
{
    const unsigned seed = 67;
    SCOPED_TRACE("seed " + std::to_string(seed));
    // Most lanes of the first step have several triangles, except where everything overlaps.
    const bool isDense = GetParam() == "pile" || GetParam() == "sizes";
    TriangleScene scene(GetParam(), isDense ? 30 : 280, seed);
    CudaTriangles trees;
    ASSERT_TRUE(trees.isThere()) << trees.why;
    checkDeformation(trees, scene);
    EXPECT_GT(trees.trees().bytes(), 116u * scene.a.size());
    if (GetParam() != "pile")
        expectRepresentative(scene);
}

std::string nameOfTriangles(const testing::TestParamInfo<std::string>& info)
{
    std::string name = info.param;
    name.erase(std::remove(name.begin(), name.end(), ' '), name.end());
    return name;
}

INSTANTIATE_TEST_SUITE_P(Cuda, CudaTriangleTrees, testing::ValuesIn(triangleKinds()), nameOfTriangles);

TEST(CudaTriangleTreesOfFew, FindPairsOfEmptyAndSingleMeshes)
{
    CudaTriangles trees;
    ASSERT_TRUE(trees.isThere()) << trees.why;
    checkSmallMeshes(trees);
}

TEST(CudaTriangleTreesOfInvalid, FindTrianglesAgainWhenRepaired)
{
    TriangleScene scene("sheets", 100, 68);
    CudaTriangles trees;
    ASSERT_TRUE(trees.isThere()) << trees.why;
    checkRepair(trees, scene);
}

TEST(CudaTriangleTreesOfExtremes, FindPairsOfMeshTree)
{
    CudaTriangles trees;
    ASSERT_TRUE(trees.isThere()) << trees.why;
    checkExtremes(trees);
}

TEST(CudaTriangleTreesOfMany, FindMillionsOfPairsInOrder)
{
    const TriangleScene scene("pile", 50, 69);
    CudaTriangles trees;
    ASSERT_TRUE(trees.isThere()) << trees.why;
    trees.build(0, scene.a);
    const TrianglePairList pairs = trees.ownPairs(0, OwnPairs::All);
    const std::uint64_t size = scene.a.size();
    EXPECT_EQ(pairs.size(), size * (size - 1) / 2);
    EXPECT_GT(pairs.size(), 10000000u);
    EXPECT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
    EXPECT_EQ(std::adjacent_find(pairs.begin(), pairs.end()), pairs.end());
}

TEST(CudaTriangleSearches, KeepPairsOfMeshesAsTheyWereWhenLaunched)
{
    const TriangleScene scene("pile", 24, 70), other("soup", 24, 70);
    CudaTriangles trees;
    ASSERT_TRUE(trees.isThere()) << trees.why;
    trees.build(0, scene.a);
    ASSERT_EQ(trees.trees().enqueueOwnPairs(0, OwnPairs::All), Status::Ok);
    // The list was too short, and is made longer before the mesh changes: the old arrays are in use until then.
    const DeviceTriangles changed = trees.upload(3, other.a);
    ASSERT_EQ(trees.trees().build(0, changed), Status::Ok);
    EXPECT_EQ(trees.collected(), ownPairsByMeshTree(scene.a, OwnPairs::All));
    EXPECT_EQ(trees.ownPairs(0, OwnPairs::All), ownPairsByMeshTree(other.a, OwnPairs::All));
}

TEST(CudaTriangleSearches, RunOnTheCallersStream)
{
    cudaStream_t stream = nullptr;
    ASSERT_EQ(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), cudaSuccess);
    {
        TriangleScene scene("sheets", 60, 71);
        CudaTriangles trees(stream);
        ASSERT_TRUE(trees.isThere()) << trees.why;
        DeviceBuffer<float> vertices;
        vertices.allocate(scene.a.vertices.size());
        DeviceTriangles mesh = trees.upload(0, scene.a);
        mesh.vertices = vertices.data();
        for (int frame = 0; frame < 3; ++frame)
        {
            // The copy, the tree and the search follow each other on the stream, and nothing waits in between.
            ASSERT_EQ(
                cudaMemcpyAsync(vertices.data(), scene.a.vertices.data(),
                                scene.a.vertices.size() * sizeof(float), cudaMemcpyHostToDevice, stream),
                cudaSuccess);
            ASSERT_EQ(trees.trees().refit(0, mesh), Status::Ok);
            EXPECT_EQ(trees.ownPairs(0, OwnPairs::WithoutNeighbours),
                      ownPairsByMeshTree(scene.a, OwnPairs::WithoutNeighbours));
            scene.step();
        }
    }
    EXPECT_EQ(cudaStreamDestroy(stream), cudaSuccess);
}

TEST(CudaTriangleTreesOfMany, ReportOutOfMemoryForTwoToThe31Triangles)
{
    CudaTriangles trees;
    ASSERT_TRUE(trees.isThere()) << trees.why;
    DeviceTriangles mesh;
    mesh.triangleCount = 0x80000000u;
    EXPECT_EQ(trees.trees().build(0, mesh), Status::OutOfMemory);
    EXPECT_EQ(trees.pairs(0, 0), TrianglePairList());
}

/// Ok and the pairs of both meshes, or the error of the call that has failed.
Status search(CudaTriangles& trees, const DeviceTriangles (&meshes)[2], TrianglePairList& pairs,
              TrianglePairList& ownPairs)
{
    pairs.clear();
    ownPairs.clear();
    for (std::uint32_t tree = 0; tree < 2; ++tree)
    {
        const Status status = trees.trees().refit(tree, meshes[tree]);
        if (status != Status::Ok)
            return status;
    }
    Status status = trees.trees().enqueuePairs(0, 1);
    if (status == Status::Ok)
        status = trees.collect(pairs);
    if (status == Status::Ok)
        status = trees.trees().enqueueOwnPairs(0, OwnPairs::All);
    return status == Status::Ok ? trees.collect(ownPairs) : status;
}

/// Each call fails once, in three frames; the same frame is then right. Returns the number of calls.
std::uint64_t failEveryCallOfTriangles(FaultInjection fault)
{
    std::vector<TriangleScene> scenes;
    std::vector<TrianglePairList> expected, expectedOwn;
    // The second has more triangles, and the third more pairs than there is room for.
    for (const char* kind : {"sheets", "soup", "pile"})
    {
        scenes.emplace_back(kind, scenes.empty() ? 6u : 14u, 72u);
        expected.push_back(pairsByMeshTree(scenes.back().a, scenes.back().b));
        expectedOwn.push_back(ownPairsByMeshTree(scenes.back().a, OwnPairs::All));
    }
    return failEachCall(fault,
                        [&](const FaultPlan& plan)
                        {
                            CudaTriangles trees;
                            ASSERT_TRUE(trees.isThere()) << trees.why;
                            DeviceArray<float> vertices[3][2];
                            DeviceArray<std::uint32_t> indices[3][2];
                            for (std::size_t frame = 0; frame < 3; ++frame)
                            {
                                for (std::size_t tree = 0; tree < 2; ++tree)
                                {
                                    const TriangleMesh& mesh = tree == 0 ? scenes[frame].a : scenes[frame].b;
                                    vertices[frame][tree].upload(mesh.vertices);
                                    indices[frame][tree].upload(mesh.indices);
                                }
                            }
                            plan.begin();
                            for (std::size_t frame = 0; frame < 3; ++frame)
                            {
                                const DeviceTriangles meshes[2] = {
                                    scenes[frame].a.at(vertices[frame][0].data(), indices[frame][0].data()),
                                    scenes[frame].b.at(vertices[frame][1].data(), indices[frame][1].data())};
                                TrianglePairList pairs, own;
                                Status status = search(trees, meshes, pairs, own);
                                if (status != Status::Ok)
                                {
                                    EXPECT_EQ(status, statusOf(fault));
                                    setCudaFault(FaultInjection::None, 0);
                                    EXPECT_EQ(trees.pairs(0, 1), TrianglePairList());
                                    status = search(trees, meshes, pairs, own);
                                }
                                ASSERT_EQ(status, Status::Ok);
                                EXPECT_EQ(pairs, expected[frame]) << "frame " << frame;
                                EXPECT_EQ(own, expectedOwn[frame]) << "frame " << frame;
                            }
                        });
}

TEST(CudaTriangleFailures, LeavePairsRightWhenAnyCallRunsOutOfMemory)
{
    EXPECT_GT(failEveryCallOfTriangles(FaultInjection::OutOfMemory), 60u);
}

TEST(CudaTriangleFailures, LeavePairsRightWhenAnyCallLosesDevice)
{
    EXPECT_GT(failEveryCallOfTriangles(FaultInjection::DeviceLost), 60u);
}

TEST(CudaTriangleFailures, GiveReasonWhenAnyCallOfStartFails)
{
    for (const FaultInjection fault : {FaultInjection::OutOfMemory, FaultInjection::DeviceLost})
    {
        const std::uint64_t calls = failEachCall(fault,
                                                 [&](const FaultPlan& plan)
                                                 {
                                                     plan.begin();
                                                     const CudaTriangles trees;
                                                     EXPECT_EQ(trees.isThere(), trees.why.empty());
                                                     EXPECT_EQ(trees.isThere(), !hasCudaFaultHappened());
                                                 });
        EXPECT_GT(calls, 5u);
    }
}

TEST(CudaTriangleFailures, GiveReasonForTooManyTreesAndForDevicesThatAreNotThere)
{
    std::string why;
    EXPECT_EQ(makeDeviceTriangleTrees(65537, 0, nullptr, &why), nullptr);
    EXPECT_NE(why.find("65,536"), std::string::npos) << why;
    EXPECT_EQ(makeDeviceTriangleTrees(1, 4096, nullptr, &why), nullptr);
    EXPECT_FALSE(why.empty());
    EXPECT_EQ(makeDeviceTriangleTrees(1, 4096, nullptr, nullptr), nullptr);
}
}  // namespace
}  // namespace cullet::test
