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
/// Scene "wall": bricks of 1 x 0.5 x 0.5 in running bond, twice as many in a row as rows, without mortar; the last body
/// is a ball of radius 1 and mass 50 that flies at the middle of the wall with 30 m/s. Friction 0.8.
std::unique_ptr<WorldScene> makeWallScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options);

/// Scene "domino": pieces of 0.1 x 1 x 0.5 stand 0.4 apart along a spiral whose arms are 1 apart; the innermost one
/// falls outward along it. Friction 0.5.
std::unique_ptr<WorldScene> makeDominoScene(const std::string& name, NamedBroadphase broadphase,
                                            const WorldSceneOptions& options);

/// Scene "cards": houses of four storeys, 26 cards of 1 x 0.7 x 0.02 each, 6 apart: pairs of cards lean against each
/// other by 20 degrees, others lie on top. The last house is as complete as the number of bodies allows, from below.
/// Friction 1. The time of their collapse is not prescribed.
std::unique_ptr<WorldScene> makeCardsScene(const std::string& name, NamedBroadphase broadphase,
                                           const WorldSceneOptions& options);

/// Scene "pyramid": cubes of 1 m in rows, each shorter by one than the row below and each cube on two others, 0.05
/// apart. The top is as complete as the number of bodies allows; 990 are 44 rows.
std::unique_ptr<WorldScene> makePyramidScene(const std::string& name, NamedBroadphase broadphase,
                                             const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
