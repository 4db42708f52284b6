// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/bodies/body_shapes.h"
#include "cullet/demos/scenes/bodies/world_scene.h"

#include <memory>
#include <string>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A world in which bodies of about one metre fall from a loose column onto a floor within four walls.
///
/// The column is at most 16 layers high; positions are random within 0.1 m, rotations uniform, and shapes drawn at
/// random. The floor is the top of a static box at y = 0; the walls reach above the column.
class BodyWorld : public WorldScene
{
public:
    BodyWorld(std::string name, NamedBroadphase broadphase, BodyShapes shapes,
              const WorldSceneOptions& options);

private:
    void addBodies(const BodyShapes& shapes);
};

/// Scene "drop": the convex hulls of options.hulls, boxes and spheres.
std::unique_ptr<WorldScene> makeDropScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options);

/// Scene "boxes": cubes of 1 m.
std::unique_ptr<WorldScene> makeBoxesScene(const std::string& name, NamedBroadphase broadphase,
                                           const WorldSceneOptions& options);

/// Scene "hulls": random hulls of options.hullPoints vertices, eight different ones.
std::unique_ptr<WorldScene> makeHullsScene(const std::string& name, NamedBroadphase broadphase,
                                           const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
