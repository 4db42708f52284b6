// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/cuda/kernels/guarded.cuh"
#include "cullet/cuda/narrow/convex_pairs.h"
#include "cullet/cuda/narrow/pair_kernels.cuh"
#include "cullet/cuda/narrow/pair_queries.h"
#include "cullet/cuda/runtime/cuda_device.h"
#include "cullet/cuda/runtime/graph_launches.cuh"

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

    Status enqueue(const DeviceBodies& bodies, const RowPair* pairs, std::uint64_t count,
                   const ConvexQuery& query) override
    {
        m_extras = {};
        if (count > std::numeric_limits<std::uint32_t>::max())
        {
            forget();
            return Status::OutOfMemory;
        }
        const convex::PairInput input = {bodies.poses, bodies.bodies, pairs,
                                         static_cast<std::uint32_t>(count)};
        // A NaN asks for none.
        const convex::QueryExtras extras = {query.maxDistance >= 0.0f, query.listOverlaps};
        return psap::guarded(
            m_exec,
            [&]
            {
                m_queries.prepare(m_exec, input.count, extras);
                launch(input);
                if (extras.isMeasured)
                    m_queries.launchDistances(m_exec, input, query.maxDistance);
                if (extras.isListed)
                    m_queries.launchList(m_exec, input.count);
                m_exec.mark();
                m_count = input.count;
                m_extras = extras;
                m_isPending = true;
            },
            [&] { drop(); });
    }

    DevicePairAnswers ahead() const override
    {
        return {m_queries.states(),
                m_queries.axes(),
                m_extras.isMeasured ? m_queries.distances() : nullptr,
                m_extras.isListed ? m_queries.overlaps() : nullptr,
                m_extras.isListed ? m_queries.overlapCount(m_count) : nullptr,
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

    /// Launches a query; from the second one with the same addresses on by one call.
    void launch(const convex::PairInput& input)
    {
        const auto launchAll = [&] { m_queries.launch(m_exec, input); };
        if (isSame(input, m_input))
        {
            m_launches.launch(m_exec.stream(), 0, 0, launchAll);
            return;
        }
        m_launches.drop();
        m_input = input;
        launchAll();
    }

    static bool isSame(const convex::PairInput& a, const convex::PairInput& b)
    {
        return a.poses == b.poses && a.bodies == b.bodies && a.pairs == b.pairs && a.count == b.count;
    }

    void drop()
    {
        m_queries.forget();
        m_launches.drop();
        m_input = {};
        m_count = 0;
        m_extras = {};
        m_isPending = false;
    }

    convex::CudaPairExec m_exec;  ///< declared before the buffers, which use its memory
    convex::PairQueries<convex::CudaPairExec> m_queries;
    psap::GraphLaunches<1> m_launches;
    convex::PairInput m_input;  ///< of the last query
    std::uint32_t m_count = 0;
    convex::QueryExtras m_extras;  ///< of the last query
    bool m_isPending = false;      ///< a query has been launched
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
