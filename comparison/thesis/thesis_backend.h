// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/psap_backend.h"
#include "cullet/comparison/backends.h"
#include "cullet/comparison/comparison_stats.h"
#include "cullet/comparison/thesis/cell_search.h"

namespace cullet::psap
{
/// The thesis's broad phase on an executor.
template <class Exec>
class ThesisBackend final : public Backend, public ComparisonSource
{
public:
    ThesisBackend(const ThesisOptions& options, const char* name) : m_backend(options, name, options) {}

    Status update(const ProxyView& proxies, PairDelta& delta) override
    {
        return m_backend.update(proxies, delta);
    }
    void restart(const Pairs& known) override { m_backend.restart(known); }
    const char* name() const noexcept override { return m_backend.name(); }
    BackendStats stats() const override { return m_backend.stats(); }
    ComparisonStats comparisonStats() const override
    {
        ComparisonStats stats;
        stats.falsePairs = m_backend.search().falsePairCount();
        return stats;
    }

private:
    PsapBackend<Exec, CellSearch, ThesisOptions> m_backend;
};
}  // namespace cullet::psap
