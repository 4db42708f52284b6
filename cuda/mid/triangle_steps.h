// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/broad/row_pair.h"
#include "cullet/cuda/mid/triangle_types.h"
#include "cullet/mid/linear_bvh_steps.h"

#include <cstdint>
#include <limits>

/// The steps of TriangleTrees before and after those of LinearBvh.
namespace cullet::triangles
{
inline constexpr float kMostFloat = std::numeric_limits<float>::max();

/// Reads the triangles of a mesh.
struct TriangleReader
{
    DeviceTriangles mesh;

    CULLET_HOST_DEVICE std::uint64_t vertexOf(std::uint64_t triangle, std::uint64_t corner) const
    {
        return mesh.indices != nullptr ? mesh.indices[triangle * mesh.indexStride + corner]
                                       : 3 * triangle + corner;
    }

    /// Exact; empty for an invalid triangle.
    CULLET_HOST_DEVICE MeshBox boxOf(std::uint64_t triangle) const
    {
        MeshBox box = linear_bvh::noBox();
        for (std::uint64_t corner = 0; corner < 3; ++corner)
        {
            const std::uint64_t vertex = vertexOf(triangle, corner);
            if (vertex >= mesh.vertexCount)
                return linear_bvh::noBox();
            const float* const at = mesh.vertices + vertex * mesh.vertexStride;
            const MeshBox point = {{at[0], at[1], at[2]}, {at[0], at[1], at[2]}};
            if (!isFinite(point))
                return linear_bvh::noBox();
            box = linear_bvh::around(box, point);
        }
        return box;
    }

    CULLET_HOST_DEVICE bool shareVertex(std::uint64_t a, std::uint64_t b) const
    {
        for (std::uint64_t i = 0; i < 3; ++i)
        {
            const std::uint64_t vertex = vertexOf(a, i);
            if (vertex == vertexOf(b, 0) || vertex == vertexOf(b, 1) || vertex == vertexOf(b, 2))
                return true;
        }
        return false;
    }

private:
    CULLET_HOST_DEVICE static bool isFinite(const MeshBox& point)
    {
        bool isInside = true;
        for (int axis = 0; axis < 3; ++axis)
            isInside = isInside && point.min[axis] >= -kMostFloat && point.max[axis] <= kMostFloat;
        return isInside;
    }
};

/// Sets the boxes of the triangles lane, lane + lanes, ..., and the box around their centres.
struct BoxStep
{
    TriangleReader triangles;
    std::uint32_t lanes;
    MeshBox* boxes;          ///< [triangles]
    MeshBox* centres;        ///< [lanes]
    std::uint32_t* invalid;  ///< number of invalid triangles

    CULLET_HOST_DEVICE void operator()(std::uint64_t lane) const
    {
        MeshBox centresOfLane = linear_bvh::noBox();
        std::uint32_t invalidOfLane = 0;
        for (std::uint64_t i = lane; i < triangles.mesh.triangleCount; i += lanes)
        {
            const MeshBox box = triangles.boxOf(i);
            boxes[i] = box;
            if (isValid(box))
                centresOfLane = linear_bvh::around(centresOfLane, centreOf(box));
            else
                ++invalidOfLane;
        }
        centres[lane] = centresOfLane;
        if (invalidOfLane != 0)
            fetchAdd(invalid, invalidOfLane);
    }

private:
    CULLET_HOST_DEVICE static MeshBox centreOf(const MeshBox& box)
    {
        MeshBox centre = box;
        for (int axis = 0; axis < 3; ++axis)
        {
            // Halves of finite numbers have a finite sum.
            centre.min[axis] = centre.max[axis] = 0.5f * box.min[axis] + 0.5f * box.max[axis];
        }
        return centre;
    }
};

/// Sets the box around the boxes lane, lane + lanes, ...
struct BoundsStep
{
    const MeshBox* from;
    std::uint32_t count;
    MeshBox* to;  ///< [lanes]
    std::uint32_t lanes;

    CULLET_HOST_DEVICE void operator()(std::uint64_t lane) const
    {
        MeshBox box = linear_bvh::noBox();
        for (std::uint64_t i = lane; i < count; i += lanes)
            box = linear_bvh::around(box, from[i]);
        to[lane] = box;
    }
};

/// Appends the pairs of the triangle of a leaf of one tree with those of another.
struct TreePairStep
{
    linear_bvh::TreeView a, b;

    template <class Emit>
    CULLET_HOST_DEVICE void operator()(std::uint64_t place, Emit& emit) const
    {
        const std::uint32_t item = a.items[place];
        const auto append = [&](std::uint32_t other) { emit.push({item, b.items[other]}); };
        emit.tested(b.search(a.leafBox(place), 0, append));
    }
};

/// Appends the pairs of the triangle of a leaf with those of later leaves of its tree, the lower number first.
struct OwnPairStep
{
    linear_bvh::TreeView tree;
    TriangleReader triangles;
    OwnPairs which;

    template <class Emit>
    CULLET_HOST_DEVICE void operator()(std::uint64_t place, Emit& emit) const
    {
        const std::uint32_t item = tree.items[place];
        const auto append = [&](std::uint32_t later)
        {
            const std::uint32_t other = tree.items[later];
            if (which == OwnPairs::All || !triangles.shareVertex(item, other))
                emit.push(item < other ? RowPair{item, other} : RowPair{other, item});
        };
        emit.tested(tree.search(tree.leafBox(place), static_cast<std::uint32_t>(place) + 1, append));
    }
};

/// Writes the number whose order is that of the pair.
struct KeyStep
{
    const RowPair* pairs;
    std::uint64_t* keys;
    int bitsOfB;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        keys[i] = std::uint64_t{pairs[i].a} << bitsOfB | pairs[i].b;
    }
};

/// Writes the pair of a number of KeyStep.
struct PairOfKeyStep
{
    const std::uint64_t* keys;
    RowPair* pairs;
    int bitsOfB;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint64_t key = keys[i];
        pairs[i] = {static_cast<std::uint32_t>(key >> bitsOfB),
                    static_cast<std::uint32_t>(key & ((std::uint64_t{1} << bitsOfB) - 1))};
    }
};
}  // namespace cullet::triangles
