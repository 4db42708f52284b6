// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/cuda/contacts/contact_finder.h"
#include "cullet/cuda/contacts/contact_search.h"
#include "cullet/cuda/kernels/guarded.cuh"
#include "cullet/cuda/narrow/pair_kernels.cuh"
#include "cullet/cuda/narrow/query_words.h"
#include "cullet/cuda/runtime/cuda_device.h"
#include "cullet/cuda/runtime/graph_launches.cuh"

#include <memory>
#include <string>

namespace cullet
{
namespace
{
using convex::CudaPairExec;

class CudaContactFinder final : public DeviceContactFinder
{
public:
    CudaContactFinder(const HullSet& hulls, const PsapOptions& options, cudaStream_t stream)
        : m_options(options), m_exec(options.device, stream), m_search(onDevice(m_exec, hulls, options))
    {
    }

    Status enqueue(const DeviceBodies& bodies, const ContactQuery& query) override
    {
        return guarded(
            [&]
            {
                finish();
                const convex::QueryExtras extras = convex::extrasOf(query.pairs);
                // A NaN is no margin.
                enqueueOrThrow({bodies.poses, bodies.bodies, query.margin > 0.0f ? query.margin : 0.0f,
                                extras, extras.isMeasured ? query.pairs.maxDistance : -1.0f,
                                extras.hasPoints ? query.pairs.contactMargin : -1.0f});
                m_exec.mark();
                m_state = State::Enqueued;
            });
    }

    DeviceContactsAhead ahead() const override
    {
        return {contactsOf(m_search->pairs().room()), m_search->pairs().count()};
    }

    Status collect(DeviceContacts& contacts, ContactCounts& counts) override
    {
        contacts = {};
        counts = {};
        return guarded(
            [&]
            {
                finish();
                if (m_state == State::None)
                    return;
                if (m_state == State::Void)
                    m_search->answerAgain(m_exec);
                m_search->completeContacts(m_exec);
                m_state = State::Collected;
                contacts = contactsOf(m_search->changes().pairs());
                counts = {convex::countsOf(m_search->counts()), m_search->changes()};
                if (m_search->input().extras.isDeep)
                    convex::setDepthCounts(m_search->contacts().counts(), counts.pairs);
            });
    }

    void forget() override
    {
        m_exec.drain();
        m_launches.drop();
        m_search->forget();
        m_state = State::None;
    }

    std::uint64_t bytes() const override { return m_exec.bytes(); }

private:
    using Search = contacts::ContactSearch<CudaPairExec>;

    enum class State
    {
        None,      ///< nothing was enqueued
        Enqueued,  ///< not finished
        Void,      ///< finished; the list of pairs is right, their answers are not
        Collected  ///< finished
    };

    static std::unique_ptr<Search> onDevice(CudaPairExec& exec, const HullSet& hulls,
                                            const PsapOptions& options)
    {
        const psap::CudaExec::DeviceGuard use(exec);
        return std::make_unique<Search>(exec, hulls, options);
    }

    template <class Body>
    Status guarded(const Body& body)
    {
        return psap::guarded(m_exec, body,
                             [&]
                             {
                                 m_launches.drop();
                                 m_search->recover(m_options);
                                 m_state = State::None;
                             });
    }

    void enqueueOrThrow(const contacts::ContactInput& input)
    {
        // Memory that a launch has made larger is elsewhere.
        if (!m_search->prepare(m_exec, input) || m_exec.bytes() != m_launchedBytes)
        {
            m_launches.drop();
            m_search->launch(m_exec);
        }
        else if (!m_search->isRepeatable(m_exec))
            m_search->launch(m_exec);
        else if (m_launches.launch(m_exec.stream(), m_search->nextPhase(), m_search->launches(),
                                   [&] { m_search->launch(m_exec); }))
            m_search->countRepeat();
        m_search->advanceNextPlan(m_exec);
        m_launchedBytes = m_exec.bytes();
    }

    void finish()
    {
        if (m_state != State::Enqueued)
            return;
        m_exec.awaitMark();
        m_state = m_search->finish(m_exec) ? State::Collected : State::Void;
        if (m_state == State::Void)
            m_launches.drop();
    }

    /// @param count of pairs, or the room for them
    DeviceContacts contactsOf(std::uint64_t count) const
    {
        return {m_search->pairs().pairs(),
                convex::answersOf(m_search->queries(), m_search->contacts(), m_search->input().extras,
                                  static_cast<std::uint32_t>(m_search->pairs().room()), count)};
    }

    PsapOptions m_options;
    CudaPairExec m_exec;  ///< declared before the buffers, which use its memory
    std::unique_ptr<Search> m_search;
    State m_state = State::None;
    psap::GraphLaunches<Search::kPhases> m_launches;
    std::uint64_t m_launchedBytes = 0;  ///< of device memory after the last launch
};
}  // namespace

std::unique_ptr<DeviceContactFinder> makeDeviceContactFinder(const HullSet& hulls, const PsapOptions& options,
                                                             CUstream_st* stream, std::string* why)
{
    return makeOnDevice(options.device, why,
                        [&]() -> std::unique_ptr<DeviceContactFinder>
                        { return std::make_unique<CudaContactFinder>(hulls, options, stream); });
}
}  // namespace cullet
