// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/narrow/host_pair_exec.h"
#include "cullet/cuda/narrow/pair_queries.h"
#include "cullet/tests/cuda/support/convex_check.h"
#include "cullet/tests/cuda/support/convex_scene.h"

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
    HostPairs(const HullSet& hulls, PsapExecutor order, std::uint32_t seed)
        : m_exec(optionsFor(order, seed)), m_queries(m_exec, hulls)
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
    const convex::PairCounts& counts() const { return m_queries.counts(); }

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
};
}  // namespace cullet::test
