// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/cuda/kernels/guarded.cuh"
#include "cullet/cuda/narrow/contact_queries.h"
#include "cullet/cuda/narrow/convex_pairs.h"
#include "cullet/cuda/narrow/pair_kernels.cuh"
#include "cullet/cuda/narrow/pair_queries.h"
#include "cullet/cuda/narrow/query_words.h"
#include "cullet/cuda/runtime/cuda_device.h"
#include "cullet/cuda/runtime/graph_launches.cuh"

#include <algorithm>
#include <cstdint>
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
        : m_exec(device, stream),
          m_queries(onDevice<convex::PairQueries<convex::CudaPairExec>>(m_exec, hulls)),
          m_contacts(onDevice<convex::ContactQueries<convex::CudaPairExec>>(m_exec, hulls))
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
        const convex::QueryExtras extras = convex::extrasOf(query);
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
                m_last = input;
                m_extras = extras;
                m_margin = query.contactMargin;
                if (extras.isDeep)
                    launchContacts(std::min(input.count, std::max(m_expected, input.count / 8)));
                m_exec.mark();
                m_isPending = true;
            },
            [&] { drop(); });
    }

    DevicePairAnswers ahead() const override
    {
        return convex::answersOf(m_queries, m_contacts, m_extras, m_last.count, m_last.count);
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
                counts = convex::countsOf(m_queries.counts());
                if (m_extras.isDeep)
                    completeContacts(counts);
                answers = ahead();
            },
            [&] { drop(); });
    }

    Status copyContacts(std::uint32_t* places, PairDepth* depths, PairContact* contacts,
                        std::uint64_t count) override
    {
        return psap::guarded(
            m_exec,
            [&]
            {
                if (places != nullptr)
                    m_exec.download(places, m_queries.overlaps(), count);
                if (depths != nullptr)
                    m_exec.download(depths, m_contacts.depths(), count);
                if (contacts != nullptr)
                    m_exec.download(contacts, m_contacts.contacts(), count);
                m_exec.wait();
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
    template <class Queries>
    static Queries onDevice(convex::CudaPairExec& exec, const HullSet& hulls)
    {
        const psap::CudaExec::DeviceGuard use(exec);
        return Queries(exec, hulls);
    }

    /// Launches depths and contacts of the last query.
    ///
    /// @param expected pairs that overlap
    void launchContacts(std::uint32_t expected)
    {
        const convex::PairReader reader = m_queries.readerOf(m_last);
        const std::uint32_t* const overlaps = m_queries.overlaps();
        const std::uint32_t* const count = m_queries.overlapCount(m_last.count);
        m_contacts.prepare(m_exec, expected, m_extras.hasPoints);
        m_contacts.launchDepths(m_exec, reader, overlaps, count);
        if (m_extras.hasPoints)
            m_contacts.launchContacts(m_exec, reader, overlaps, count, m_margin);
    }

    /// Launches them once more where the memory was too small for all.
    void completeContacts(ConvexPairCounts& counts)
    {
        m_expected = counts.overlapping;
        if (m_contacts.room() < counts.overlapping)
        {
            launchContacts(counts.overlapping);
            m_exec.mark();
            m_exec.awaitMark();
        }
        convex::setDepthCounts(m_contacts.counts(), counts);
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
        m_contacts.forget();
        m_launches.drop();
        m_input = m_last = {};
        m_extras = {};
        m_isPending = false;
    }

    convex::CudaPairExec m_exec;  ///< declared before the buffers, which use its memory
    convex::PairQueries<convex::CudaPairExec> m_queries;
    convex::ContactQueries<convex::CudaPairExec> m_contacts;
    psap::GraphLaunches<1> m_launches;
    convex::PairInput m_input;        ///< of the launches
    convex::PairInput m_last;         ///< of the last query
    convex::QueryExtras m_extras;     ///< likewise
    float m_margin = -1.0f;           ///< likewise
    std::uint32_t m_expected = 1024;  ///< pairs that overlap
    bool m_isPending = false;         ///< a query has been launched
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
