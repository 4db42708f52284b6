// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/mid/triangle_types.h"
#include "cullet/mid/mesh_tree.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace cullet::test
{
/// A mesh in the CPU's memory, with the strides of DeviceTriangles.
struct TriangleMesh
{
    std::vector<float> vertices;
    std::uint64_t vertexStride = 3;
    std::vector<std::uint32_t> indices;  ///< empty: three vertices after another
    std::uint64_t indexStride = 3;

    std::uint32_t vertexCount() const { return static_cast<std::uint32_t>(vertices.size() / vertexStride); }
    std::uint32_t size() const
    {
        return indices.empty() ? vertexCount() / 3 : static_cast<std::uint32_t>(indices.size() / indexStride);
    }
    float* vertex(std::uint64_t i) { return &vertices[i * vertexStride]; }

    /// With other addresses.
    DeviceTriangles at(const float* vertexMemory, const std::uint32_t* indexMemory) const
    {
        return {vertexMemory, vertexStride, vertexCount(), size(), indices.empty() ? nullptr : indexMemory,
                indexStride};
    }

    std::uint64_t vertexOf(std::uint64_t triangle, std::uint64_t corner) const
    {
        return indices.empty() ? 3 * triangle + corner : indices[triangle * indexStride + corner];
    }

    /// By mid/'s function, from points in double.
    MeshBox boxOf(std::uint64_t triangle) const
    {
        std::array<std::array<double, 3>, 3> corners = {};
        for (std::size_t corner = 0; corner < 3; ++corner)
        {
            const std::uint64_t vertex = vertexOf(triangle, corner);
            if (vertex >= vertexCount())
                return kEmptyMeshBox;
            for (std::size_t axis = 0; axis < 3; ++axis)
                corners[corner][axis] = double(vertices[vertex * vertexStride + axis]);
        }
        return boxOfTriangle(corners.data(), 0.0);
    }

    std::vector<MeshBox> boxes() const
    {
        std::vector<MeshBox> all;
        for (std::uint32_t i = 0; i < size(); ++i)
            all.push_back(boxOf(i));
        return all;
    }

    std::uint64_t invalidCount() const
    {
        const std::vector<MeshBox> all = boxes();
        return static_cast<std::uint64_t>(
            std::count_if(all.begin(), all.end(), [](const MeshBox& box) { return !isValid(box); }));
    }

    bool shareVertex(std::uint64_t a, std::uint64_t b) const
    {
        for (std::uint64_t i = 0; i < 9; ++i)
        {
            if (vertexOf(a, i / 3) == vertexOf(b, i % 3))
                return true;
        }
        return false;
    }
};

using TrianglePairList = std::vector<std::array<std::uint32_t, 2>>;

/// The pairs of triangles whose boxes overlap, found with the CPU's tree, in order.
inline TrianglePairList pairsByMeshTree(const TriangleMesh& a, const TriangleMesh& b)
{
    const std::vector<MeshBox> queries = a.boxes(), boxes = b.boxes();
    MeshTree tree;
    tree.build(boxes.data(), static_cast<std::uint32_t>(boxes.size()), nullptr);
    TrianglePairList pairs;
    std::vector<std::uint32_t> found;
    for (std::uint32_t i = 0; i < queries.size(); ++i)
    {
        found.clear();
        if (isValid(queries[i]))
            tree.findOverlaps(queries[i], found);
        for (const std::uint32_t k : found)
            pairs.push_back({i, k});
    }
    return pairs;
}

inline TrianglePairList ownPairsByMeshTree(const TriangleMesh& mesh, OwnPairs which)
{
    TrianglePairList pairs;
    for (const auto& pair : pairsByMeshTree(mesh, mesh))
    {
        if (pair[0] < pair[1] && (which == OwnPairs::All || !mesh.shareVertex(pair[0], pair[1])))
            pairs.push_back(pair);
    }
    return pairs;
}

/// Meshes that deform, by the name of what is special about them.
class TriangleScene
{
public:
    /// @param side about the square root of half of the number of triangles
    TriangleScene(const std::string& kind, std::uint32_t side, unsigned seed) : m_random(seed), m_kind(kind)
    {
        a = kind == "soup" || kind == "sizes" ? makeSoup(2 * side * side) : makeSheet(side);
        b = kind == "sheet over soup" ? makeSoup(side * side) : makeSheet(side / 2 + 2);
        if (kind == "spoilt")
            spoil();
        if (kind == "pile")
            std::fill(a.vertices.begin(), a.vertices.end(), 0.25f);
        step();
    }

    /// Moves the vertices: waves go through sheets, and soups mix.
    void step()
    {
        ++m_frame;
        if (m_kind == "pile")
            return;
        move(a, 0.0f);
        move(b, 0.35f);
    }

    TriangleMesh a, b;

private:
    /// A sheet of two triangles a cell, with gaps in its arrays.
    TriangleMesh makeSheet(std::uint32_t side)
    {
        TriangleMesh mesh;
        mesh.vertexStride = 4;
        mesh.indexStride = 5;
        for (std::uint32_t i = 0; i < (side + 1) * (side + 1); ++i)
        {
            const float x = static_cast<float>(i % (side + 1)) / static_cast<float>(side);
            const float z = static_cast<float>(i / (side + 1)) / static_cast<float>(side);
            mesh.vertices.insert(mesh.vertices.end(), {10.0f * x, 0.0f, 10.0f * z, kGap});
        }
        for (std::uint32_t i = 0; i < side * side; ++i)
        {
            const std::uint32_t corner = i % side + i / side * (side + 1), next = corner + side + 1;
            mesh.indices.insert(mesh.indices.end(), {corner, next, corner + 1, 0xffffffffu, 0xffffffffu});
            mesh.indices.insert(mesh.indices.end(), {corner + 1, next, next + 1, 0xffffffffu, 0xffffffffu});
        }
        return mesh;
    }

    TriangleMesh makeSoup(std::uint32_t triangles)
    {
        TriangleMesh mesh;
        // As many neighbours for any number of triangles.
        const float usual = 3.6f / std::cbrt(static_cast<float>(triangles));
        for (std::uint32_t i = 0; i < triangles; ++i)
        {
            const float size = m_kind == "sizes" ? m_random.logUniform(-20, 3) : usual;
            std::array<float, 3> centre = m_random.point(0.0f, 10.0f);
            centre[1] *= 0.1f;
            for (int corner = 0; corner < 3; ++corner)
            {
                const std::array<float, 3> offset = m_random.point(-size, size);
                for (std::size_t axis = 0; axis < 3; ++axis)
                    mesh.vertices.push_back(centre[axis] + offset[axis]);
            }
        }
        return mesh;
    }

    /// A tenth of the triangles loses a vertex.
    void spoil()
    {
        const float bad[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                             -std::numeric_limits<float>::infinity()};
        for (std::uint32_t i = 0; i < a.size(); i += 30)
        {
            a.indices[i * a.indexStride + m_random.below(3)] = i % 60 == 0 ? a.vertexCount() : 0xffffffffu;
            a.vertex(m_random.below(a.vertexCount()))[m_random.below(3)] = bad[i / 30 % 3];
        }
    }

    void move(TriangleMesh& mesh, float phase)
    {
        const float time = 0.3f * static_cast<float>(m_frame) + phase;
        const bool isSheet = !mesh.indices.empty();
        for (std::uint32_t i = 0; i < mesh.vertexCount(); ++i)
        {
            float* const at = mesh.vertex(i);
            if (isSheet)
                at[1] = std::isfinite(at[1]) ? 0.4f * std::sin(at[0] + time) * std::cos(1.7f * at[2]) : at[1];
            else
                at[2] += 0.1f * std::sin(5.0f * at[0] + time);
        }
    }

    static constexpr float kGap = std::numeric_limits<float>::signaling_NaN();

    Random m_random;
    std::string m_kind;
    int m_frame = 0;
};

inline const std::vector<std::string>& triangleKinds()
{
    static const std::vector<std::string> kinds = {"sheets", "sheet over soup", "soup",
                                                   "sizes",  "spoilt",          "pile"};
    return kinds;
}
}  // namespace cullet::test
