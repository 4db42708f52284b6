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
/// Scene "static": static cubes of 2 m, uniform, 32 m^3 of space each, and among them 100 that fly straight at 3 to 6
/// m/s without response and turn back at the faces of the space. Only their boxes are set in each step
/// (setForceUpdateAllAabbs(false)), as usual in a mostly static world.
std::unique_ptr<WorldScene> makeStaticScene(const std::string& name, NamedBroadphase broadphase,
                                            const WorldSceneOptions& options);

/// Scene "statics": a floor of static cubes of 1 m, each raised by up to 0.2 or lowered, and cubes of 1 m that fall onto
/// it, one above each square of 8 x 8: 65,536 static ones for 1,000. All boxes are set in each step, Bullet's default.
std::unique_ptr<WorldScene> makeStaticsScene(const std::string& name, NamedBroadphase broadphase,
                                             const WorldSceneOptions& options);

/// Scene "planet": boxes with edges log-uniform from 0.1 to 10^5 m, six decades, uniform in a shell around a planet, a
/// static sphere of radius 10^5. Each orbits it about its own axis, by 0.05 to 0.1 of its half edge per step; no
/// response, no gravity. The size of the shell gives each box a few pairs.
std::unique_ptr<WorldScene> makePlanetScene(const std::string& name, NamedBroadphase broadphase,
                                            const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
