// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/bodies/world_scene.h"

#include <memory>
#include <string>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Scene "ragdolls": dolls of 1.7 m, eleven capsules of mass 1 each with six cone-twist joints and four hinges, fall
/// from 0.3 m in a lattice 3.5 apart, each turned about its vertical axis. Damping and sleeping thresholds are usual ones of
/// ragdolls. The number of bodies is rounded down to whole dolls, at least one.
std::unique_ptr<WorldScene> makeRagdollsScene(const std::string& name, NamedBroadphase broadphase,
                                              const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
