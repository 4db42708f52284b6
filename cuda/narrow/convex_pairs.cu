// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/cuda/kernels/guarded.cuh"
#include "cullet/cuda/narrow/convex_pairs.h"
#include "cullet/cuda/narrow/pair_kernels.cuh"
#include "cullet/cuda/narrow/pair_queries.h"
#include "cullet/cuda/runtime/cuda_device.h"

#include <limits>
#include <memory>
#include <string>

namespace cullet
{
namespace
{
class CudaConvexPairs final : public DeviceConvexPairs
{
public:
    CudaConvexPairs(const HullSet& hulls, int device, cudaStream_t stream)
        : m_exec(device, stream), m_queries(onDevice(m_exec, hulls))
    {
    }

    Status enqueue(const DeviceBodies& bodies, const RowPair* pairs, std::uint64_t count) override
    {
        return enqueueWith({bodies.poses, bodies.bodies, pairs, 0}, count,
                           [&](const convex::PairInput& input) { m_queries.launch(m_exec, input); });
    }

    Status enqueueDistances(const DeviceBodies& bodies, const RowPair* pairs, std::uint64_t count,
                            float maxDistance) override
    {
        const Status status = enqueueWith({bodies.poses, bodies.bodies, pairs, 0}, count,
                                          [&](const convex::PairInput& input)
                                          { m_queries.launchDistances(m_exec, input, maxDistance); });
        m_isMeasured = status == Status::Ok;
        return status;
    }

    DevicePairAnswers ahead() const override
    {
        return {m_queries.states(), m_queries.axes(), m_isMeasured ? m_queries.distances() : nullptr,
                m_count};
    }

    Status collect(DevicePairAnswers& answers, ConvexPairCounts& counts) override
    {
        answers = {};
        counts = {};
        return psap::guarded(
            m_exec,
            [&]
            {
                if (!m_isPending)
                    return;
                m_exec.awaitMark();
                const convex::PairCounts& found = m_queries.counts();
                counts = {found.overlapping, found.undecided,  found.invalid,
                          found.failed,      found.remembered, found.doubtful};
                answers = ahead();
            },
            [&] { drop(); });
    }

    void forget() override
    {
        m_exec.drain();
        drop();
    }

    std::uint64_t bytes() const override { return m_exec.bytes(); }

private:
    static convex::PairQueries<convex::CudaPairExec> onDevice(convex::CudaPairExec& exec,
                                                              const HullSet& hulls)
    {
        const psap::CudaExec::DeviceGuard use(exec);
        return convex::PairQueries<convex::CudaPairExec>(exec, hulls);
    }

    /// Calls launch() with the input and its count.
    template <class Launch>
    Status enqueueWith(convex::PairInput input, std::uint64_t count, const Launch& launch)
    {
        m_isMeasured = false;
        if (count > std::numeric_limits<std::uint32_t>::max())
        {
            forget();
            return Status::OutOfMemory;
        }
        input.count = static_cast<std::uint32_t>(count);
        return psap::guarded(
            m_exec,
            [&]
            {
                launch(input);
                m_exec.mark();
                m_count = count;
                m_isPending = true;
            },
            [&] { drop(); });
    }

    void drop()
    {
        m_queries.forget();
        m_count = 0;
        m_isPending = false;
    }

    convex::CudaPairExec m_exec;  ///< declared before the buffers, which use its memory
    convex::PairQueries<convex::CudaPairExec> m_queries;
    std::uint64_t m_count = 0;
    bool m_isPending = false;   ///< a query has been launched
    bool m_isMeasured = false;  ///< with distances
};
}  // namespace

std::unique_ptr<DeviceConvexPairs> makeDeviceConvexPairs(const HullSet& hulls, int device,
                                                         CUstream_st* stream, std::string* why)
{
    return makeOnDevice(device, why,
                        [&]() -> std::unique_ptr<DeviceConvexPairs>
                        { return std::make_unique<CudaConvexPairs>(hulls, device, stream); });
}
}  // namespace cullet
