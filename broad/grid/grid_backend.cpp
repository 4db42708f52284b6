// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/backend.h"
#include "cullet/broad/grid/column_grid_backend.h"
#include "cullet/broad/small/few_changes_policy.h"
#include "cullet/broad/small/small_world_backend.h"

#include <limits>
#include <new>

namespace cullet
{
namespace
{
/// The default grid: a SmallWorldBackend up to a few hundred rows, and up to some more while few of them change; else a
/// ColumnGridBackend.
class SizedGridBackend final : public Backend, public CellSource, public RowSource
{
public:
    explicit SizedGridBackend(const GridOptions& options)
        : m_options(options),
          m_smallWorld(std::make_unique<SmallWorldBackend>(options.baselineSimd)),
          m_smallWorldLimit(options.flatLimit == GridOptions::kMeasured ? m_smallWorld->worthwhileRows()
                                                                        : options.flatLimit),
          m_fewChangesLimit(options.flatLimit == GridOptions::kMeasured
                                ? FewChangesPolicy::kMostRowsFactor * m_smallWorldLimit
                                : m_smallWorldLimit)
    {
    }

    Status update(const ProxyView& proxies, PairDelta& delta) override
    try
    {
        m_policy.count(proxies.dirtyCount, proxies.size);
        const bool isSmall = proxies.size <= (m_policy.areFew() ? m_fewChangesLimit : m_smallWorldLimit);
        if (m_smallWorld != nullptr && !isSmall)
            changeToGrid();
        else if (m_smallWorld == nullptr && isSmall)
            changeToSmallWorld(proxies);
        return current().update(proxies, delta);
    }
    catch (const std::bad_alloc&)
    {
        delta.clear();
        return Status::OutOfMemory;
    }

    /// Without pairs it begins as a new one, and frees the memory of the grid.
    void restart(const Pairs& known) override
    {
        if (known.empty() && m_grid != nullptr)
            replaceGrid();
        current().restart(known);
    }

    const char* name() const noexcept override { return "grid"; }
    BackendStats stats() const override
    {
        BackendStats stats = current().stats();
        stats.rebuildsTotal += m_rebuildsBefore;
        return stats;
    }
    void forEachCell(const CellVisitor& visit) const override
    {
        if (m_grid != nullptr)
            m_grid->forEachCell(visit);
    }
    std::uint32_t findNearRay(const RayPath& ray, const Aabb* boxes, RowSink& sink) const override
    {
        return m_grid != nullptr ? m_grid->findNearRay(ray, boxes, sink) : 0;
    }
    std::uint32_t findNearBox(const Aabb& box, const Aabb* boxes, RowSink& sink) const override
    {
        return m_grid != nullptr ? m_grid->findNearBox(box, boxes, sink) : 0;
    }

private:
    void changeToGrid()
    {
        auto grid = std::make_unique<ColumnGridBackend>(m_options);
        grid->restart(m_smallWorld->heldPairs());
        m_grid = std::move(grid);
        m_smallWorld.reset();
    }

    void changeToSmallWorld(const ProxyView& proxies)
    {
        const Pairs held = m_grid->heldPairs(proxies);
        replaceGrid();
        m_smallWorld->restart(held);
    }

    /// By a SmallWorldBackend without rows.
    void replaceGrid()
    {
        auto smallWorld = std::make_unique<SmallWorldBackend>(m_options.baselineSimd);
        m_rebuildsBefore += m_grid->stats().rebuildsTotal;
        m_smallWorld = std::move(smallWorld);
        m_grid.reset();
    }

    Backend& current() const
    {
        return m_smallWorld != nullptr ? static_cast<Backend&>(*m_smallWorld)
                                       : static_cast<Backend&>(*m_grid);
    }

    GridOptions m_options;
    std::unique_ptr<SmallWorldBackend> m_smallWorld;  ///< null while the grid is in use
    std::unique_ptr<ColumnGridBackend> m_grid;        ///< null while m_smallWorld is in use
    std::uint32_t m_smallWorldLimit;
    std::uint32_t m_fewChangesLimit;  ///< rows, while few of them change
    FewChangesPolicy m_policy;
    std::uint64_t m_rebuildsBefore = 0;  ///< rebuilds of grids that a SmallWorldBackend replaced
};
}  // namespace

std::unique_ptr<Backend> makeGridBackend(const GridOptions& options)
{
    if (options.flatLimit == 0)
        return std::make_unique<ColumnGridBackend>(options);
    return std::make_unique<SizedGridBackend>(options);
}
}  // namespace cullet
