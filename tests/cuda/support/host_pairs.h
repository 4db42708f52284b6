// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/narrow/contact_queries.h"
#include "cullet/cuda/narrow/host_pair_exec.h"
#include "cullet/cuda/narrow/pair_queries.h"
#include "cullet/tests/cuda/support/convex_check.h"
#include "cullet/tests/cuda/support/convex_scene.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace cullet::test
{
/// Adds how pairs were answered.
inline void add(const convex::PairCounts& counts, convex::PairCounts& sum)
{
    sum.failed += counts.failed;
    sum.remembered += counts.remembered;
    sum.doubtful += counts.doubtful;
}

/// Convex pairs on the CPU's executor.
class HostPairs
{
public:
    HostPairs(const HullSet& hulls, PsapExecutor order, std::uint32_t seed,
              const convex::PolytopeSizes& polytopes = {})
        : m_exec(optionsFor(order, seed)), m_queries(m_exec, hulls), m_contacts(m_exec, hulls, polytopes)
    {
    }

    ConvexAnswers query(const ConvexBodies& bodies)
    {
        m_queries.prepare(m_exec, inputOf(bodies).count, {});
        m_queries.launch(m_exec, inputOf(bodies));
        return answersOf(bodies.pairs.size());
    }
    /// With distances and the list of overlaps.
    ConvexAnswers measure(const ConvexBodies& bodies, float most)
    {
        const convex::PairInput input = inputOf(bodies);
        m_queries.prepare(m_exec, input.count, {true, true});
        m_queries.launch(m_exec, input);
        m_queries.launchDistances(m_exec, input, most);
        m_queries.launchList(m_exec, input.count);
        ConvexAnswers answers = answersOf(input.count);
        answers.distances.assign(m_queries.distances(), m_queries.distances() + input.count);
        answers.overlaps.assign(m_queries.overlaps(),
                                m_queries.overlaps() + *m_queries.overlapCount(input.count));
        return answers;
    }
    /// With contacts.
    ///
    /// @param expected pairs that overlap; later ones are left out
    ConvexAnswers contacts(const ConvexBodies& bodies, float margin, std::uint32_t expected = 0xffffffffu)
    {
        const convex::PairInput input = inputOf(bodies);
        m_queries.prepare(m_exec, input.count, {false, true, true, true});
        m_queries.launch(m_exec, input);
        m_queries.launchList(m_exec, input.count);
        const std::uint32_t* const overlaps = m_queries.overlaps();
        const std::uint32_t* const count = m_queries.overlapCount(input.count);
        m_contacts.prepare(m_exec, std::min(expected, input.count), true);
        m_contacts.launchDepths(m_exec, m_queries.readerOf(input), overlaps, count);
        m_contacts.launchContacts(m_exec, m_queries.readerOf(input), overlaps, count, margin);
        ConvexAnswers answers = answersOf(input.count);
        answers.overlaps.assign(overlaps, overlaps + *count);
        const std::uint32_t found = std::min(*count, m_contacts.room());
        answers.depths.assign(m_contacts.depths(), m_contacts.depths() + found);
        answers.contacts.assign(m_contacts.contacts(), m_contacts.contacts() + found);
        return answers;
    }
    void forget()
    {
        m_queries.forget();
        m_contacts.forget();
    }
    const convex::PairCounts& counts() const { return m_queries.counts(); }
    const convex::DepthCounts& depthCounts() const { return m_contacts.counts(); }

private:
    static convex::PairInput inputOf(const ConvexBodies& bodies)
    {
        return {bodies.poses.data(), static_cast<std::uint32_t>(bodies.poses.size()), bodies.pairs.data(),
                static_cast<std::uint32_t>(bodies.pairs.size())};
    }

    ConvexAnswers answersOf(std::size_t count) const
    {
        return {{m_queries.states(), m_queries.states() + count},
                {m_queries.axes(), m_queries.axes() + count},
                {},
                {},
                {},
                {}};
    }

    static PsapOptions optionsFor(PsapExecutor order, std::uint32_t seed)
    {
        PsapOptions options;
        options.executor = order;
        options.seed = seed;
        options.threads = 2;
        return options;
    }

    convex::HostPairExec m_exec;
    convex::PairQueries<convex::HostPairExec> m_queries;
    convex::ContactQueries<convex::HostPairExec> m_contacts;
};
}  // namespace cullet::test
