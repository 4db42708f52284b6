// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/contacts/contact_search.h"
#include "cullet/cuda/narrow/host_pair_exec.h"
#include "cullet/tests/cuda/support/convex_check.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace cullet::test
{
/// What a ContactSearch has found.
struct FoundContacts
{
    std::vector<RowPair> pairs;
    ConvexAnswers answers;
    convex::PairCounts counts;
    DeltaCounts changes = {};
};

inline bool haveSameBits(const FoundContacts& a, const FoundContacts& b)
{
    return a.pairs.size() == b.pairs.size() &&
           (a.pairs.empty() ||
            std::memcmp(a.pairs.data(), b.pairs.data(), a.pairs.size() * sizeof(RowPair)) == 0) &&
           haveSameBits(a.answers, b.answers);
}

/// A ContactSearch on the CPU's executor.
class HostContacts
{
public:
    HostContacts(const HullSet& hulls, const PsapOptions& options)
        : m_options(options), m_exec(options), m_search(m_exec, hulls, options)
    {
    }

    /// @param maxDistance   of distances; negative: none
    /// @param contactMargin of contacts; negative: none
    FoundContacts query(const std::vector<BodyPose>& poses, float margin = 0.0f, float maxDistance = -1.0f,
                        float contactMargin = -1.0f)
    {
        m_poses = poses;
        convex::QueryExtras extras;
        extras.isMeasured = maxDistance >= 0.0f;
        extras.isListed = true;
        extras.isDeep = extras.hasPoints = contactMargin >= 0.0f;
        m_search.prepare(m_exec, {m_poses.data(), static_cast<std::uint32_t>(m_poses.size()), margin, extras,
                                  maxDistance, contactMargin});
        m_search.launch(m_exec);
        m_search.advanceNextPlan(m_exec);
        m_followed += m_search.mode() == psap::NeighbourMode::Follow;
        if (!m_search.finish(m_exec))
        {
            ++m_repeats;
            m_search.answerAgain(m_exec);
        }
        m_search.completeContacts(m_exec);
        return found();
    }
    void forget() { m_search.forget(); }
    void recover() { m_search.recover(m_options); }

    int repeats() const { return m_repeats; }
    /// Queries that began with a list of neighbours.
    int followed() const { return m_followed; }
    std::vector<Aabb> boxes() const { return {m_search.boxes(), m_search.boxes() + m_poses.size()}; }

private:
    FoundContacts found() const
    {
        const auto& queries = m_search.queries();
        const std::uint64_t count = *m_search.pairs().count();
        FoundContacts contacts;
        contacts.pairs.assign(m_search.pairs().pairs(), m_search.pairs().pairs() + count);
        contacts.answers.states.assign(queries.states(), queries.states() + count);
        contacts.answers.axes.assign(queries.axes(), queries.axes() + count);
        if (m_search.input().extras.isMeasured)
            contacts.answers.distances.assign(queries.distances(), queries.distances() + count);
        const auto room = static_cast<std::uint32_t>(m_search.pairs().room());
        contacts.answers.overlaps.assign(queries.overlaps(),
                                         queries.overlaps() + *queries.overlapCount(room));
        if (m_search.input().extras.isDeep)
        {
            const auto& deep = m_search.contacts();
            const std::size_t overlapping = contacts.answers.overlaps.size();
            EXPECT_LE(overlapping, deep.room());
            contacts.answers.depths.assign(deep.depths(), deep.depths() + overlapping);
            contacts.answers.contacts.assign(deep.contacts(), deep.contacts() + overlapping);
        }
        contacts.counts = m_search.counts();
        contacts.changes = m_search.changes();
        return contacts;
    }

    PsapOptions m_options;
    convex::HostPairExec m_exec;
    contacts::ContactSearch<convex::HostPairExec> m_search;
    std::vector<BodyPose> m_poses;
    int m_repeats = 0, m_followed = 0;
};

inline PsapOptions contactOptions(PsapExecutor order, std::uint32_t seed, std::uint32_t capacity = 1024)
{
    PsapOptions options;
    options.executor = order;
    options.seed = seed;
    options.threads = 2;
    options.initialCapacity = capacity;
    return options;
}
}  // namespace cullet::test
