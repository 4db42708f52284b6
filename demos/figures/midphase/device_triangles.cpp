// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/cuda/mid/triangle_trees.h"
#include "cullet/demos/bench/cuda/support/cuda_timing.h"
#include "cullet/demos/figures/midphase/triangle_motion.h"
#include "cullet/demos/program/stopwatch.h"

#include <memory>
#include <vector>

namespace cullet
{
namespace
{
/// A copy of an array in device memory.
template <class T>
class DeviceCopy
{
public:
    explicit DeviceCopy(const std::vector<T>& from)
    {
        checkCuda(cudaMalloc(reinterpret_cast<void**>(&m_data), from.size() * sizeof(T)));
        checkCuda(cudaMemcpy(m_data, from.data(), from.size() * sizeof(T), cudaMemcpyHostToDevice));
    }
    DeviceCopy(const DeviceCopy&) = delete;
    DeviceCopy& operator=(const DeviceCopy&) = delete;
    ~DeviceCopy() { cudaFree(m_data); }
    const T* data() const { return m_data; }

private:
    T* m_data = nullptr;
};

/// Sets both trees and searches their pairs.
class DeviceSearch
{
public:
    explicit DeviceSearch(const TriangleMotion& motion) : m_motion(motion), m_indices(motion.indices())
    {
        m_trees = makeDeviceTriangleTrees(TriangleMotion::kSheets, 0, nullptr, nullptr);
    }

    bool isThere() const { return m_trees != nullptr; }

    /// Wall milliseconds; collect() has waited.
    double time(int frame, bool isRefitted)
    {
        const DeviceCopy<float> vertices[] = {DeviceCopy<float>(m_motion.vertices(0, frame)),
                                              DeviceCopy<float>(m_motion.vertices(1, frame))};
        checkCuda(cudaDeviceSynchronize());
        const Stopwatch watch;
        for (std::uint32_t sheet = 0; sheet < TriangleMotion::kSheets; ++sheet)
        {
            DeviceTriangles mesh;
            mesh.vertices = vertices[sheet].data();
            mesh.vertexCount = static_cast<std::uint32_t>(m_motion.vertices(sheet, frame).size() / 3);
            mesh.triangleCount = m_motion.triangles();
            mesh.indices = m_indices.data();
            requireOk(isRefitted ? m_trees->refit(sheet, mesh) : m_trees->build(sheet, mesh));
        }
        requireOk(m_trees->enqueuePairs(0, 1));
        requireOk(m_trees->collect(m_found));
        return watch.wallMs();
    }

    std::vector<RowPair> pairs() const
    {
        std::vector<RowPair> pairs(m_found.count);
        checkCuda(
            cudaMemcpy(pairs.data(), m_found.pairs, pairs.size() * sizeof(RowPair), cudaMemcpyDeviceToHost));
        return pairs;
    }

private:
    const TriangleMotion& m_motion;
    DeviceCopy<std::uint32_t> m_indices;
    std::unique_ptr<DeviceTriangleTrees> m_trees;
    DeviceTrianglePairs m_found;
};
}  // namespace

TriangleTimes timeDeviceTrees(const TriangleMotion& motion, bool isRefitted)
{
    TriangleTimes times;
    if (makeDeviceTriangleTrees(1, 0, nullptr, nullptr) == nullptr)
        return times;
    DeviceSearch search(motion);
    // Memory grows, and kernels are loaded, in frames that are not timed.
    for (int frame = 0; frame < 2; ++frame)
        search.time(frame % motion.frameCount(), isRefitted);
    for (int frame = 0; frame < motion.frameCount(); ++frame)
    {
        times.ms.push_back(search.time(frame, isRefitted));
        for (const RowPair& pair : search.pairs())
            times.add(pair.a, pair.b);
    }
    return times;
}
}  // namespace cullet
