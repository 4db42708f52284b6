// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/box_scene.h"

#include <memory>

namespace cullet
{
// Bodies spread uniformly in a cube whose volume grows with their number, so that pairs per body stay the same.
// Bodies that move fly straight and bounce off the cube's walls.

/// Spheres of radius 1, 32 units of volume each: about one overlapping pair per body. All move 0.05 to 0.1 a frame.
std::unique_ptr<BoxScene> makeUniformScene(const BoxSceneOptions& options);

/// Edges log-uniform from 0.1 to 100, 20,000 units of volume each: about 3.7 pairs per body. All move 0.05 to 0.1
/// of their half edge a frame.
std::unique_ptr<BoxScene> makeTwoSizesScene(const BoxSceneOptions& options);

/// The uniform scene of which the same 5 % move in every frame.
std::unique_ptr<BoxScene> makeMostlyStaticScene(const BoxSceneOptions& options);

/// The uniform scene of which a fresh 5 % move in each frame.
std::unique_ptr<BoxScene> makeFreshMoversScene(const BoxSceneOptions& options);

/// The uniform scene of which a fresh tenth moves in each frame.
std::unique_ptr<BoxScene> makeFreshTenthScene(const BoxSceneOptions& options);

/// The uniform scene in which every body teleports to a new random position in each frame.
std::unique_ptr<BoxScene> makeTeleportScene(const BoxSceneOptions& options);

/// The uniform scene at rest, except at most 100 moving bodies.
std::unique_ptr<BoxScene> makeHundredMoversScene(const BoxSceneOptions& options);
}  // namespace cullet
