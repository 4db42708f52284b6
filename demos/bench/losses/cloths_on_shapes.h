// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/bodies/world_scene.h"

#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
enum class ClothGround
{
    Hulls,  ///< of 42 points and 90 cm, a metre apart
    Mesh    ///< hills with edges of half a metre
};

/// Cloths of 4 m with 289 nodes each, side by side, fall onto static shapes and lie there; a btSoftRigidDynamicsWorld.
///
/// @param options bodies: cloths
std::unique_ptr<WorldScene> makeClothsOnShapes(ClothGround ground, const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
