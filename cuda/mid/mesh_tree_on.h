// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/exec/executor_failure.h"
#include "cullet/cuda/mid/triangle_steps.h"
#include "cullet/mid/linear_bvh.h"

#include <algorithm>
#include <cstdint>

namespace cullet::triangles
{
/// The tree of one mesh on an executor. Its steps are launched, and not waited for.
///
/// @tparam Exec psap::HostExec or psap::CudaExec
template <class Exec>
class MeshTreeOn
{
public:
    explicit MeshTreeOn(Exec& exec) : m_tree(exec) {}

    /// Errors: what the executor throws, and ExecutorFailure for 2^31 triangles or more
    void build(Exec& exec, const DeviceTriangles& mesh)
    {
        if (mesh.triangleCount > kMostTriangles)
            throw psap::ExecutorFailure{Status::OutOfMemory, "MeshTreeOn::build()", "2^31 triangles or more"};
        m_mesh = mesh;
        const std::uint32_t lanes = lanesOf(mesh.triangleCount);
        exec.reserve(m_invalid, 1);
        // The boxes of all rounds one after the other: each has a 64th of the last.
        exec.reserve(m_centres, 2 * std::uint64_t{lanes} + kRounds);
        m_tree.reserveBoxes(mesh.triangleCount);
        setBoxes(exec);
        m_tree.buildFromBoxes(boundsOfCentres(exec, lanes));
    }

    /// build(), unless the mesh has as many triangles as the tree.
    void refit(Exec& exec, const DeviceTriangles& mesh)
    {
        if (mesh.triangleCount != m_tree.size())
        {
            build(exec, mesh);
            return;
        }
        m_mesh = mesh;
        if (m_tree.size() == 0)
            return;
        setBoxes(exec);
        m_tree.refitToBoxes();
    }

    void forget() { m_tree.forget(); }

    std::uint32_t size() const { return m_tree.size(); }
    linear_bvh::TreeView view() const { return m_tree.view(); }
    TriangleReader reader() const { return {m_mesh}; }
    /// Number of invalid triangles, in the executor's memory. @pre size() > 0
    const std::uint32_t* invalid() const { return m_invalid.data(); }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    static constexpr std::uint32_t kMostTriangles = 0x7fffffffu;
    static constexpr std::uint32_t kMostLanes = 1u << 16;
    static constexpr std::uint32_t kBoxesOfLane = 64;
    static constexpr std::uint32_t kRounds = 3;

    static std::uint32_t lanesOf(std::uint32_t triangles) { return std::min(triangles, kMostLanes); }

    void setBoxes(Exec& exec)
    {
        const std::uint32_t lanes = lanesOf(m_mesh.triangleCount);
        exec.clear(m_invalid.data(), 1);
        exec.forEach(lanes, BoxStep{reader(), lanes, m_tree.boxes(), m_centres.data(), m_invalid.data()});
    }

    const MeshBox* boundsOfCentres(Exec& exec, std::uint32_t count)
    {
        MeshBox* from = m_centres.data();
        while (count > 1)
        {
            const std::uint32_t lanes = (count + kBoxesOfLane - 1) / kBoxesOfLane;
            exec.forEach(lanes, BoundsStep{from, count, from + count, lanes});
            from += count;
            count = lanes;
        }
        return from;
    }

    LinearBvh<Exec> m_tree;
    DeviceTriangles m_mesh;
    Buffer<MeshBox> m_centres;
    Buffer<std::uint32_t> m_invalid;
};
}  // namespace cullet::triangles
