// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/step/island_groups.h"
#include "cullet/plugin/step/island_tasks.h"

#include <vector>

class btDispatcher;
class btIDebugDraw;
struct btContactSolverInfo;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// All groups of a step, for Solver::solveTasks().
struct SolverTasks
{
    IslandGroups& islands;
    const std::vector<IslandGroup>& groups;
    const IslandTasks& tasks;
    const btContactSolverInfo& info;
    btIDebugDraw* debugDrawer;
    btDispatcher* dispatcher;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
