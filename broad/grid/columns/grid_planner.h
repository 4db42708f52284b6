// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/grid/columns/grid_plan.h"

#include <cstdint>

namespace cullet
{
/// The plan of a column grid, and what decides when it is made anew.
class GridPlanner
{
public:
    explicit GridPlanner(const GridOptions& options) : m_limits{options.cellScale, options.levels, 0} {}

    const GridPlan& plan() const { return m_plan; }
    bool hasPlan() const { return m_hasPlan; }

    /// Makes a plan for boxes of these sizes.
    ///
    /// @param proxyRows [count] rows of `boxes`, or null for 0 .. count - 1
    /// @param cellSkin  see GridInput
    void make(const Aabb* boxes, const std::uint32_t* proxyRows, std::uint32_t count, float cellSkin,
              const SizeHistogram& sizes);

    /// Whether sizes or skin have become so different that another plan is due.
    bool isStale(const SizeHistogram& sizes, float cellSkin) const;

    /// Learns from the work of a scan how crowded the scene is.
    ///
    /// @return whether the plan expected so much less or more work that isStale() holds from now on
    bool learnDensity(std::uint64_t entries, std::uint64_t tests);

private:
    GridPlanLimits m_limits;
    GridPlan m_plan;
    SizeHistogram m_plannedSizes;  ///< sizes that the plan was made for
    double m_density = 1;
    bool m_hasPlan = false;
};
}  // namespace cullet
