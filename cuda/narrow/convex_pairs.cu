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
        m_last.extras = {};
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
                if (extras.isDeep)
                    m_contacts.prepare(m_exec, std::min(input.count, std::max(m_expected, input.count / 8)),
                                       extras.hasPoints);
                m_last = {input, extras, query.maxDistance, query.contactMargin, m_contacts.room()};
                launch();
                m_exec.mark();
                m_isPending = true;
            },
            [&] { drop(); });
    }

    DevicePairAnswers ahead() const override
    {
        return convex::answersOf(m_queries, m_contacts, m_last.extras, m_last.input.count,
                                 m_last.input.count);
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
                if (m_last.extras.isDeep)
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

    /// What launches depend on.
    struct Launches
    {
        convex::PairInput input;
        convex::QueryExtras extras;
        float maxDistance = 0.0f, margin = -1.0f;
        std::uint32_t room = 0;  ///< for contacts
    };

    static bool isSame(const Launches& a, const Launches& b)
    {
        return a.input.poses == b.input.poses && a.input.bodies == b.input.bodies &&
               a.input.pairs == b.input.pairs && a.input.count == b.input.count &&
               a.extras.isMeasured == b.extras.isMeasured && a.extras.isListed == b.extras.isListed &&
               a.extras.isDeep == b.extras.isDeep && a.extras.hasPoints == b.extras.hasPoints &&
               a.maxDistance == b.maxDistance && a.margin == b.margin && a.room == b.room;
    }

    /// Launches the last query; if it is launched as the one before, by one call.
    void launch()
    {
        const auto launchAll = [&]
        {
            m_queries.launch(m_exec, m_last.input);
            if (m_last.extras.isMeasured)
                m_queries.launchDistances(m_exec, m_last.input, m_last.maxDistance);
            if (m_last.extras.isListed)
                m_queries.launchList(m_exec, m_last.input.count);
            if (m_last.extras.isDeep)
                launchContacts();
        };
        if (isSame(m_last, m_recorded))
        {
            m_launches.launch(m_exec.stream(), 0, 0, launchAll);
            return;
        }
        m_launches.drop();
        m_recorded = m_last;
        launchAll();
    }

    /// Launches depths and contacts of the last query.
    void launchContacts()
    {
        const convex::PairReader reader = m_queries.readerOf(m_last.input);
        const std::uint32_t* const overlaps = m_queries.overlaps();
        const std::uint32_t* const count = m_queries.overlapCount(m_last.input.count);
        m_contacts.launchDepths(m_exec, reader, overlaps, count);
        if (m_last.extras.hasPoints)
            m_contacts.launchContacts(m_exec, reader, overlaps, count, m_last.margin);
    }

    /// Launches them once more where the memory was too small for all.
    void completeContacts(ConvexPairCounts& counts)
    {
        m_expected = counts.overlapping;
        if (m_contacts.room() < counts.overlapping)
        {
            m_contacts.prepare(m_exec, counts.overlapping, m_last.extras.hasPoints);
            launchContacts();
            m_exec.mark();
            m_exec.awaitMark();
        }
        convex::setDepthCounts(m_contacts.counts(), counts);
    }

    void drop()
    {
        m_queries.forget();
        m_contacts.forget();
        m_launches.drop();
        m_recorded = m_last = {};
        m_isPending = false;
    }

    convex::CudaPairExec m_exec;  ///< declared before the buffers, which use its memory
    convex::PairQueries<convex::CudaPairExec> m_queries;
    convex::ContactQueries<convex::CudaPairExec> m_contacts;
    psap::GraphLaunches<1> m_launches;
    Launches m_recorded;              ///< of the launches in m_launches, or those to be recorded
    Launches m_last;                  ///< of the last query
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
