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
/// Scene "stampede": half of the bodies are ray-cast vehicles of 800 kg with four wheels, 6 by 8 m apart, that drive
/// along z over low bumps and change their steering once a second; the others are ghosts, spheres of radius 6, one
/// around each vehicle. Rays, ghosts and ordinary pairs at once.
std::unique_ptr<WorldScene> makeStampedeScene(const std::string& name, NamedBroadphase broadphase,
                                              const WorldSceneOptions& options);

/// Scene "crowd": kinematic characters (capsules of radius 0.4, 1.6 high, each a ghost of its own) walk at 3 m/s to
/// random places of a square, 4 m^2 for each, between pillars, and around each other.
std::unique_ptr<WorldScene> makeCrowdScene(const std::string& name, NamedBroadphase broadphase,
                                           const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
