// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/cuda/kernels/guarded.cuh"
#include "cullet/cuda/mid/triangle_searches.h"
#include "cullet/cuda/mid/triangle_trees.h"
#include "cullet/cuda/runtime/cuda_device.h"

#include <memory>
#include <string>

namespace cullet
{
namespace
{
constexpr std::uint32_t kMostTrees = 1u << 16;

class CudaTriangleTrees final : public DeviceTriangleTrees
{
public:
    CudaTriangleTrees(std::uint32_t trees, int device, cudaStream_t stream)
        : m_exec(optionsFor(device), stream), m_searches(m_exec, trees)
    {
    }

    std::uint32_t trees() const override { return m_searches.trees(); }

    Status build(std::uint32_t tree, const DeviceTriangles& mesh) override
    {
        return guarded([&] { m_searches.build(tree, mesh); });
    }

    Status refit(std::uint32_t tree, const DeviceTriangles& mesh) override
    {
        return guarded([&] { m_searches.refit(tree, mesh); });
    }

    Status enqueuePairs(std::uint32_t a, std::uint32_t b) override
    {
        return guarded([&] { m_searches.launchPairs(a, b); });
    }

    Status enqueueOwnPairs(std::uint32_t tree, OwnPairs which) override
    {
        return guarded([&] { m_searches.launchOwnPairs(tree, which); });
    }

    Status collect(DeviceTrianglePairs& pairs) override
    {
        pairs = {};
        return guarded([&] { pairs = m_searches.collect(); });
    }

    std::uint64_t bytes() const override { return m_exec.bytes(); }

private:
    template <class Body>
    Status guarded(const Body& body)
    {
        return psap::guarded(m_exec, body, [&] { m_searches.forget(); });
    }

    static PsapOptions optionsFor(int device)
    {
        PsapOptions options;
        options.device = device;
        return options;
    }

    psap::CudaExec m_exec;  ///< declared before the buffers, which use its memory
    triangles::TriangleSearches<psap::CudaExec> m_searches;
};
}  // namespace

std::unique_ptr<DeviceTriangleTrees> makeDeviceTriangleTrees(std::uint32_t trees, int device,
                                                             CUstream_st* stream, std::string* why)
{
    return makeOnDevice(device, why,
                        [&]() -> std::unique_ptr<DeviceTriangleTrees>
                        {
                            if (trees > kMostTrees)
                                throw psap::ExecutorFailure{Status::OutOfMemory, "makeDeviceTriangleTrees()",
                                                            "more than 65,536 trees"};
                            return std::make_unique<CudaTriangleTrees>(trees, device, stream);
                        });
}
}  // namespace cullet
