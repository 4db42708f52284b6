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
/// Scene "barrels": hulls of 44 points, four rings of eleven, stand on each other in columns 1.5 apart, 15 high at
/// most, with 0.1 between them at the start.
std::unique_ptr<WorldScene> makeBarrelsScene(const std::string& name, NamedBroadphase broadphase,
                                             const WorldSceneOptions& options);

/// Scene "hills": random hulls of options.hullPoints vertices, eight different ones, fall in layers onto a mesh of
/// triangles with edges of 1 m: hills within a rim.
std::unique_ptr<WorldScene> makeHillsScene(const std::string& name, NamedBroadphase broadphase,
                                           const WorldSceneOptions& options);

/// Scene "terrain": as "hills", in one layer over 25 triangles for each hull, 100,000 for 4,000.
std::unique_ptr<WorldScene> makeTerrainScene(const std::string& name, NamedBroadphase broadphase,
                                             const WorldSceneOptions& options);

/// Scene "free-hulls": random hulls of 64 vertices, eight different ones, spin by 0.5 to 2 rad/s in a lattice without
/// gravity. The spheres of diameter 1 that hold them are two of Bullet's margins apart, so that boxes of neighbours
/// overlap, narrow phases test them, and the solver has next to nothing to do.
std::unique_ptr<WorldScene> makeFreeHullsScene(const std::string& name, NamedBroadphase broadphase,
                                               const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
