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
        const std::size_t count = bodies.pairs.size();
        m_queries.launch(m_exec, {bodies.poses.data(), static_cast<std::uint32_t>(bodies.poses.size()),
                                  bodies.pairs.data(), static_cast<std::uint32_t>(count)});
        return {{m_queries.states(), m_queries.states() + count},
                {m_queries.axes(), m_queries.axes() + count}};
    }
    const convex::PairCounts& counts() const { return m_queries.counts(); }

private:
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
