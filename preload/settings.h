// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/isa_gjk.h"
#include "cullet/plugin/solver/solver_options.h"

#include <optional>

namespace cullet::preload
{
/// The settings from the environment; see docs/drop-in.md.
struct Settings
{
    bool replacesBroadphase = true;     ///< CULLET_BACKEND is not dbvt
    bool replacesNarrowPhase = true;    ///< CULLET_NARROW is not 0
    bool replacesWorld = false;         ///< CULLET_WORLD is 1
    std::optional<SolverModel> solver;  ///< CULLET_SOLVER; otherwise solvers are Bullet's
    std::optional<bool> fillsTrees;     ///< CULLET_TREES; otherwise set if the program seems to need them
    bool hasSummary = false;            ///< CULLET_STATS
    BroadphaseOptions broadphase;
    IsaGjkOptions narrowPhase;  ///< CULLET_BOXES, CULLET_MESHES, CULLET_ACTIVE_EDGES, CULLET_PATCH_POINTS,
                                ///< CULLET_REUSE_POSE
};

/// Read from the environment in the first call, which reports invalid values on stderr.
const Settings& settings();
}  // namespace cullet::preload
