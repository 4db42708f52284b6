// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/columns/grid_planner.h"

#include <algorithm>

namespace cullet
{
void GridPlanner::make(const Aabb* boxes, const std::uint32_t* proxyRows, std::uint32_t count, float cellSkin,
                       const SizeHistogram& sizes)
{
    float span[3];
    measureSpans(boxes, proxyRows, count, span);
    const int axis = chooseSweepAxis(span, m_hasPlan ? m_plan.sweepAxis : 0);
    m_limits.leastWidth = kSkinsPerCell * cellSkin;
    m_plan = makeGridPlan(sizes, span, axis, m_density, m_limits);
    m_plannedSizes = sizes;
    m_hasPlan = true;
}

bool GridPlanner::isStale(const SizeHistogram& sizes, float cellSkin) const
{
    const bool isPlanLimited = m_plan.narrowest <= m_limits.leastWidth;
    if (isPlanLimited && 4 * kSkinsPerCell * cellSkin < m_limits.leastWidth)
        return true;
    const std::uint32_t total = sizes.count();
    std::uint32_t moved = 0;
    for (std::size_t o = 0; o < sizes.bins.size(); ++o)
    {
        const std::uint32_t now = sizes.bins[o].count;
        const std::uint32_t then = m_plannedSizes.bins[o].count;
        moved += now > then ? now - then : then - now;
        // A size that was absent when the plan was made may be far larger than its columns.
        if (now != 0 && then == 0 && static_cast<std::int32_t>(o) > 0 && now > total / 64)
            return true;
    }
    return moved > total / 4 + 8;
}

bool GridPlanner::learnDensity(std::uint64_t entryCount, std::uint64_t testCount)
{
    if (m_limits.cellScale > 0)
        return false;
    const double entries = static_cast<double>(entryCount);
    const double lanes = static_cast<double>(testCount) - 6 * entries;
    const double measured = std::max(lanes, entries);
    const double predicted = std::max(m_plan.predictedCandidates, entries);
    const double ratio = measured / predicted;
    if (ratio > 0.4 && ratio < 2.5)
        return false;
    m_density = std::min(std::max(m_density * ratio, 1e-3), 1e6);
    m_plannedSizes = SizeHistogram();
    return true;
}
}  // namespace cullet
