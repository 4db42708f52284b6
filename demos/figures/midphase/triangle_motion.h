// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <vector>

namespace cullet
{
/// Two sheets that waves go through, one across the other: as many pairs for a triangle at any size.
class TriangleMotion
{
public:
    static constexpr std::uint32_t kSheets = 2;

    /// @param triangles about how many, of both sheets
    TriangleMotion(std::uint32_t triangles, int frames);

    int frameCount() const { return static_cast<int>(m_vertices[0].size()); }
    /// Three coordinates a vertex.
    const std::vector<float>& vertices(std::uint32_t sheet, int frame) const
    {
        return m_vertices[sheet][static_cast<std::size_t>(frame)];
    }
    /// Three vertices a triangle, of either sheet.
    const std::vector<std::uint32_t>& indices() const { return m_indices; }
    /// Of a sheet.
    std::uint32_t triangles() const { return static_cast<std::uint32_t>(m_indices.size() / 3); }

private:
    std::vector<std::vector<float>> m_vertices[kSheets];
    std::vector<std::uint32_t> m_indices;
};

/// Times of a subject, a number for each frame: from the vertices of both sheets to the list of pairs.
struct TriangleTimes
{
    std::vector<double> ms;
    std::uint64_t pairs = 0;  ///< over all frames
    std::uint64_t hash = 0;   ///< of all pairs, in any order

    void add(std::uint32_t a, std::uint32_t b);
};

/// The CPU's tree of eight boxes a node, built in each frame; one thread.
TriangleTimes timeWideTree(const TriangleMotion& motion);
/// LinearBvh on the CPU, one thread.
TriangleTimes timeLinearTree(const TriangleMotion& motion, bool isRefitted);
/// DeviceTriangleTrees, with vertices in device memory. Pairs are sorted there and stay there.
///
/// @return no frames where no device answers
TriangleTimes timeDeviceTrees(const TriangleMotion& motion, bool isRefitted);
}  // namespace cullet
