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
/// Scene "city": boxes, spheres, capsules and hulls of 20 points fall onto streets, roofs, stairs and statues. All are one
/// mesh, whose edges are between 4 cm (statues) and the width of the city (the ground's two triangles).
std::unique_ptr<WorldScene> makeCityScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options);

/// Scene "needles": the same kinds of bodies fall onto low hills of triangles that are 2 cm wide and 8 m long.
std::unique_ptr<WorldScene> makeNeedlesScene(const std::string& name, NamedBroadphase broadphase,
                                             const WorldSceneOptions& options);

/// Scene "slide", with WorldSceneOptions::activeEdges: spheres, boxes, capsules, cylinders and hulls of 16 and 64 points
/// slide without friction over a flat mesh with edges of 0.5 m, at 1 to 15 m/s. Each has a lane along x, and begins it
/// anew at its end. A body that leaves the height or the speed it began with has hit an edge inside of the mesh.
std::unique_ptr<WorldScene> makeSlideScene(const std::string& name, NamedBroadphase broadphase,
                                           const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
