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
/// Scene "robots": multibodies of a chassis and four driven wheels, hulls of 44 points each, drive on a walled floor.
std::unique_ptr<WorldScene> makeRobotsScene(const std::string& name, NamedBroadphase broadphase,
                                            const WorldSceneOptions& options);

/// Scene "compounds": compounds of five hulls of options.hullPoints vertices, a core and four arms, fall from a cube of
/// them into a walled square.
std::unique_ptr<WorldScene> makeCompoundsScene(const std::string& name, NamedBroadphase broadphase,
                                               const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
