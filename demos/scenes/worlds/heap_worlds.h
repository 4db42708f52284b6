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
/// Scene "pour": in every tenth step a twentieth of the bodies, four at least, leave a square spout 10 m up at 5 m/s,
/// 1.25 apart, and fall into a walled square: boxes of 0.7 and spheres of radius 0.4 in turn, rotations uniform. Once
/// all bodies are in the world the oldest ones are removed and poured again.
std::unique_ptr<WorldScene> makePourScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options);

/// Scene "pile": cubes of 1 m in a heap of slope 0.6 on an open floor, 1.12 apart across and 1.02 up, each
/// turned about the vertical by up to 0.1 rad: dense from the start, and settling.
std::unique_ptr<WorldScene> makePileScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
