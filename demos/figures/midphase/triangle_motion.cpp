// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/figures/midphase/triangle_motion.h"

#include "cullet/cuda/host/host_exec.h"
#include "cullet/demos/program/stopwatch.h"
#include "cullet/demos/scenes/splitmix64.h"
#include "cullet/mid/linear_bvh.h"
#include "cullet/mid/mesh_tree.h"

#include <algorithm>
#include <cmath>

namespace cullet
{
namespace
{
/// The height of a sheet.
float heightAt(std::uint32_t sheet, float x, float z, int frame)
{
    const float time = 0.1f * static_cast<float>(frame), across = sheet == 0 ? 1.0f : 1.3f;
    return 0.8f * std::sin(0.37f * across * x + time) * std::cos(0.23f * z / across);
}

std::vector<MeshBox> boxesOf(const TriangleMotion& motion, std::uint32_t sheet, int frame)
{
    const std::vector<float>& vertices = motion.vertices(sheet, frame);
    std::vector<MeshBox> boxes(motion.triangles());
    for (std::size_t i = 0; i < boxes.size(); ++i)
    {
        const float* corners[3];
        for (std::size_t corner = 0; corner < 3; ++corner)
            corners[corner] = &vertices[3 * std::size_t{motion.indices()[3 * i + corner]}];
        boxes[i] = boxOfTriangle(corners, 0.0);
    }
    return boxes;
}

MeshBox boundsOf(const std::vector<MeshBox>& boxes)
{
    MeshBox bounds = kEmptyMeshBox;
    for (const MeshBox& box : boxes)
        bounds = linear_bvh::around(bounds, box);
    return bounds;
}

/// LinearBvh on the CPU, with its list of pairs.
class LinearSearch
{
public:
    void setTree(const std::vector<MeshBox>& boxes, bool isRefitted)
    {
        if (isRefitted && m_tree.size() == boxes.size())
            m_tree.refit(boxes.data());
        else
            m_tree.build(boxes.data(), static_cast<std::uint32_t>(boxes.size()), boundsOf(boxes));
    }

    /// The pairs are m_pairs, as many as are returned.
    std::uint64_t search(const std::vector<MeshBox>& queries)
    {
        for (;;)
        {
            std::uint64_t count = 0;
            m_tree.findOverlaps(queries.data(), static_cast<std::uint32_t>(queries.size()),
                                psap::PairList{m_pairs.data(), m_pairs.size(), &count});
            if (count <= m_pairs.size())
                return count;
            m_pairs.resize(count);
        }
    }

    const RowPair& pair(std::uint64_t i) const { return m_pairs[i]; }

private:
    psap::HostExec m_exec{PsapOptions()};
    LinearBvh<psap::HostExec> m_tree{m_exec};
    std::vector<RowPair> m_pairs = std::vector<RowPair>(1 << 16);
};
}  // namespace

TriangleMotion::TriangleMotion(std::uint32_t triangles, int frames)
{
    const auto side = static_cast<std::uint32_t>(std::sqrt(triangles / 4.0));
    for (std::uint32_t i = 0; i < side * side; ++i)
    {
        const std::uint32_t corner = i % side + i / side * (side + 1), next = corner + side + 1;
        m_indices.insert(m_indices.end(), {corner, next, corner + 1, corner + 1, next, next + 1});
    }
    for (std::uint32_t sheet = 0; sheet < kSheets; ++sheet)
    {
        const float shift = sheet == 0 ? 0.0f : 0.4f;
        for (int frame = 0; frame < frames; ++frame)
        {
            std::vector<float> vertices;
            for (std::uint32_t i = 0; i < (side + 1) * (side + 1); ++i)
            {
                const float x = static_cast<float>(i % (side + 1)) + shift;
                const float z = static_cast<float>(i / (side + 1)) + shift;
                vertices.insert(vertices.end(), {x, heightAt(sheet, x, z, frame), z});
            }
            m_vertices[sheet].push_back(std::move(vertices));
        }
    }
}

void TriangleTimes::add(std::uint32_t a, std::uint32_t b)
{
    ++pairs;
    hash += splitMix(std::uint64_t{a} << 32 | b);
}

TriangleTimes timeWideTree(const TriangleMotion& motion)
{
    TriangleTimes times;
    MeshTree tree;
    std::vector<std::uint32_t> found, ends;
    for (int frame = 0; frame < motion.frameCount(); ++frame)
    {
        const Stopwatch watch;
        const std::vector<MeshBox> queries = boxesOf(motion, 0, frame), boxes = boxesOf(motion, 1, frame);
        tree.build(boxes.data(), static_cast<std::uint32_t>(boxes.size()), nullptr);
        found.clear();
        ends.clear();
        for (const MeshBox& query : queries)
        {
            tree.findOverlaps(query, found);
            ends.push_back(static_cast<std::uint32_t>(found.size()));
        }
        times.ms.push_back(watch.cpuMs());
        for (std::uint32_t a = 0, i = 0; a < ends.size(); ++a)
        {
            for (; i < ends[a]; ++i)
                times.add(a, found[i]);
        }
    }
    return times;
}

TriangleTimes timeLinearTree(const TriangleMotion& motion, bool isRefitted)
{
    TriangleTimes times;
    LinearSearch search;
    for (int frame = 0; frame < motion.frameCount(); ++frame)
    {
        const Stopwatch watch;
        const std::vector<MeshBox> queries = boxesOf(motion, 0, frame), boxes = boxesOf(motion, 1, frame);
        search.setTree(boxes, isRefitted);
        const std::uint64_t count = search.search(queries);
        times.ms.push_back(watch.cpuMs());
        for (std::uint64_t i = 0; i < count; ++i)
            times.add(search.pair(i).a, search.pair(i).b);
    }
    return times;
}
}  // namespace cullet
