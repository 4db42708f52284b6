// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/bodies/world_scene.h"

#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
enum class MeshShape
{
    Cylinder,         ///< radius 0.5 m, length 1 m, on its side
    CompoundOfHulls,  ///< 50 hulls of 16 points
    GImpactTorus      ///< 128 triangles
};

/// Bodies of one shape that fall by a few centimetres onto a mesh of triangles with edges of 0.5 m, and lie there.
std::unique_ptr<WorldScene> makeShapesOnMesh(MeshShape shape, const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
