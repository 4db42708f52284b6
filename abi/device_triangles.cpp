// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Functions of the C interface that find pairs of triangles in GPU memory.
#include "cullet/abi/device_status.h"
#include "cullet/abi/status.h"
#include "cullet/cuda/mid/triangle_trees.h"

#include <memory>
#include <string>

using namespace cullet;
using namespace cullet::abi;

struct cullet_triangle_trees
{
    std::unique_ptr<DeviceTriangleTrees> trees;
    bool hasSearch = false;
};

namespace
{
constexpr std::uint32_t kMostTrees = 1u << 16;
constexpr std::uint32_t kUsualTrees = 2;
constexpr std::uint64_t kUsualStride = 3;

DeviceTriangles meshOf(const cullet_device_mesh* mesh)
{
    requirePointer(mesh, "mesh is NULL");
    const auto known = readOptions<sizeof(cullet_device_mesh)>(mesh);
    require(known.triangle_count < 1u << 31, CULLET_ERROR_ARGUMENT, "triangle_count: 2^31 or more");
    require(known.vertex_count == 0 || known.vertices != nullptr, CULLET_ERROR_NULL, "vertices is NULL");
    DeviceTriangles triangles;
    triangles.vertices = known.vertices;
    triangles.vertexStride = known.vertex_stride == 0 ? kUsualStride : known.vertex_stride;
    triangles.vertexCount = known.vertex_count;
    triangles.triangleCount = known.triangle_count;
    triangles.indices = known.indices;
    triangles.indexStride = known.index_stride == 0 ? kUsualStride : known.index_stride;
    return triangles;
}

void requireTree(const cullet_triangle_trees* trees, std::uint32_t tree)
{
    requirePointer(trees, "trees is NULL");
    require(tree < trees->trees->trees(), CULLET_ERROR_ARGUMENT,
            "tree: a number below that of trees expected");
}

/// Calls a function of the trees; after a failure there is no search to collect.
template <class Call>
void callDevice(cullet_triangle_trees* trees, const Call& call)
{
    const Status status = call(*trees->trees);
    if (status != Status::Ok)
        trees->hasSearch = false;
    requireDevice(status);
}

/// Gives a mesh to a tree by a function of the trees.
cullet_status giveMesh(cullet_triangle_trees* trees, std::uint32_t tree, const cullet_device_mesh* mesh,
                       Status (DeviceTriangleTrees::*give)(std::uint32_t, const DeviceTriangles&))
{
    return guarded(
        [&]
        {
            requireTree(trees, tree);
            const DeviceTriangles known = meshOf(mesh);
            callDevice(trees, [&](DeviceTriangleTrees& device) { return (device.*give)(tree, known); });
            return CULLET_OK;
        });
}
}  // namespace

cullet_status cullet_triangle_trees_create(const cullet_triangle_trees_options* options,
                                           cullet_triangle_trees** trees)
{
    return guarded(
        [&]
        {
            requirePointer(trees, "trees is NULL");
            const auto known = readOptions<sizeof(cullet_triangle_trees_options)>(options);
            requireOrdinal(known.device);
            require(known.trees <= kMostTrees, CULLET_ERROR_ARGUMENT, "trees: more than 65536");
            std::string why;
            auto made = makeDeviceTriangleTrees(known.trees == 0 ? kUsualTrees : known.trees, known.device,
                                                static_cast<CUstream_st*>(known.stream), &why);
            requireMade(made.get(), why);
            *trees = new cullet_triangle_trees{std::move(made)};
            return CULLET_OK;
        });
}

void cullet_triangle_trees_destroy(cullet_triangle_trees* trees)
{
    delete trees;
}

cullet_status cullet_triangle_trees_build(cullet_triangle_trees* trees, uint32_t tree,
                                          const cullet_device_mesh* mesh)
{
    return giveMesh(trees, tree, mesh, &DeviceTriangleTrees::build);
}

cullet_status cullet_triangle_trees_refit(cullet_triangle_trees* trees, uint32_t tree,
                                          const cullet_device_mesh* mesh)
{
    return giveMesh(trees, tree, mesh, &DeviceTriangleTrees::refit);
}

cullet_status cullet_triangle_trees_enqueue_pairs(cullet_triangle_trees* trees, uint32_t a, uint32_t b)
{
    return guarded(
        [&]
        {
            requireTree(trees, a);
            requireTree(trees, b);
            callDevice(trees, [&](DeviceTriangleTrees& device) { return device.enqueuePairs(a, b); });
            trees->hasSearch = true;
            return CULLET_OK;
        });
}

cullet_status cullet_triangle_trees_enqueue_own_pairs(cullet_triangle_trees* trees, uint32_t tree,
                                                      int32_t which)
{
    return guarded(
        [&]
        {
            requireTree(trees, tree);
            require(which == CULLET_OWN_PAIRS_ALL || which == CULLET_OWN_PAIRS_WITHOUT_NEIGHBOURS,
                    CULLET_ERROR_ARGUMENT, "which: CULLET_OWN_PAIRS_ALL or another of its kind expected");
            const OwnPairs known =
                which == CULLET_OWN_PAIRS_ALL ? OwnPairs::All : OwnPairs::WithoutNeighbours;
            callDevice(trees,
                       [&](DeviceTriangleTrees& device) { return device.enqueueOwnPairs(tree, known); });
            trees->hasSearch = true;
            return CULLET_OK;
        });
}

cullet_status cullet_triangle_trees_collect(cullet_triangle_trees* trees, cullet_pairs* device_pairs,
                                            uint64_t* invalid)
{
    return guarded(
        [&]
        {
            requirePointer(trees, "trees is NULL");
            requirePointer(device_pairs, "device_pairs is NULL");
            require(trees->hasSearch, CULLET_ERROR_ARGUMENT, "no search before, or a call failed");
            DeviceTrianglePairs found;
            callDevice(trees, [&](DeviceTriangleTrees& device) { return device.collect(found); });
            *device_pairs = {reinterpret_cast<const cullet_pair*>(found.pairs), found.count};
            if (invalid != nullptr)
                *invalid = found.invalid;
            return CULLET_OK;
        });
}
