// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Makes the plan of a column grid, and decides when it is made anew.
#include "cullet/broad/grid/columns/column_grid.h"

#include <algorithm>

namespace cullet
{
namespace
{
constexpr std::uint32_t kShortestFollow = 8;
// Cells are at least so many skins wide: a box that fits its cells touches few of them with its skin.
constexpr float kSkinsPerCell = 8;
}  // namespace

void ColumnGrid::preparePlan(const GridInput& input)
{
    if (m_hasPlan)
        return;
    SizeHistogram sizes;
    const std::uint32_t stride = std::max(1u, input.count / 1024);
    sizes.weight = stride;
    for (std::uint32_t i = 0; i < input.count; i += stride)
    {
        const Aabb& box = input.boxes[input.proxyRows != nullptr ? input.proxyRows[i] : i];
        if (kindOf(box, input.grow) != BoxKind::Bounded)
            continue;
        const float y = box.max[1] - box.min[1];
        const float z = box.max[2] - box.min[2];
        const std::int32_t octave = std::max(octaveOf(std::max(y, z)), kLowestOctave) - kLowestOctave;
        SizeHistogram::Bin& bin = sizes.bins[static_cast<std::size_t>(octave)];
        bin.count += stride;
        bin.tileSum += 0.5 * stride * (static_cast<double>(y) + z);
        bin.sweepSum += static_cast<double>(stride) * (box.max[0] - box.min[0]);
    }
    makePlan(input, sizes);
}

void ColumnGrid::makePlan(const GridInput& input, const SizeHistogram& sizes)
{
    float span[3];
    measureSpans(input.boxes, input.proxyRows, input.count, span);
    const int axis = chooseSweepAxis(span, m_hasPlan ? m_plan.sweepAxis : 0);
    m_leastWidth = kSkinsPerCell * input.cellSkin;
    m_plan =
        makeGridPlan(sizes, span, axis, m_density, {m_options.cellScale, m_options.levels, m_leastWidth});
    m_plannedSizes = sizes;
    m_hasPlan = true;
}

bool ColumnGrid::isPlanStale(const SizeHistogram& sizes, float cellSkin) const
{
    const bool isPlanLimited = m_plan.narrowest <= m_leastWidth;
    if (isPlanLimited && 4 * kSkinsPerCell * cellSkin < m_leastWidth)
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

void ColumnGrid::learnDensity()
{
    const double entries = static_cast<double>(m_entryCount);
    const double lanes = static_cast<double>(m_testCount) - 6 * entries;
    const double measured = std::max(lanes, entries);
    const double predicted = std::max(m_plan.predictedCandidates, entries);
    const double ratio = measured / predicted;
    if (ratio > 0.4 && ratio < 2.5)
        return;
    m_density = std::min(std::max(m_density * ratio, 1e-3), 1e6);
    m_plannedSizes = SizeHistogram();
    // A minimum of followed scans avoids a refill in every update, should the prediction stay wrong.
    if (m_followedScans >= kShortestFollow)
        m_isFollowable = false;
}
}  // namespace cullet
