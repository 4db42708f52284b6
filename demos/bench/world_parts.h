// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/bodies/world_scene.h"

#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// What a world of the benchmark is made of.
struct WorldParts
{
    std::string name;  ///< "stock", "mt", "all" or parts joined by "+"; empty: chosen by the other names
    std::string backend = "dbvt";
    std::string narrow = "bullet";
    std::string update = "bullet";
    std::string solver = "bullet";
    double reuse = 0;  ///< see WorldSceneOptions
    bool isMt = false;

    WorldSceneOptions options(const WorldSceneOptions& scene, int threads) const;
};

/// Worlds by name: "stock"; cullet's "broadphase", "dispatcher" and "world", each without the others or joined by "+";
/// "all" three; "mt", Bullet's btDiscreteDynamicsWorldMt.
///
/// Leaves out "mt", with a message, where the Bullet library has no threads.
///
/// @param backend cullet's broad phase
/// @throws ProgramError (kExitUsage) for an unknown name, (kExitUnavailable) if nothing remains
std::vector<WorldParts> partsNamed(const std::vector<std::string>& names, const std::string& backend);

/// Each of the worlds with each of the solvers.
std::vector<WorldParts> withSolvers(const std::vector<WorldParts>& worlds,
                                    const std::vector<std::string>& solvers);

/// Each of the worlds with each distance of IsaGjkOptions::reusePose; those with Bullet's narrow phase once, without.
std::vector<WorldParts> withReuse(const std::vector<WorldParts>& worlds,
                                  const std::vector<double>& distances);

/// Each backend with each narrow phase and each update of the boxes, without names.
std::vector<WorldParts> allCombinations(const std::vector<std::string>& backends,
                                        const std::vector<std::string>& narrow,
                                        const std::vector<std::string>& updates);
}  // namespace CULLET_PRECISION
}  // namespace cullet
