// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/demos/scenes/box_scene.h"
#include "cullet/demos/scenes/splitmix64.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Speeds of the thesis's spheres, in radii per frame.
constexpr float kSlowest = 0.05f;
constexpr float kFastest = 0.1f;

/// A body of a box scene: a cube around a centre, with a velocity per frame.
struct Ball
{
    float centre[3];
    float half;  ///< half the edge of its box
    float velocity[3];
};

Aabb boxOf(const Ball& ball) noexcept;

/// Random direction times `speed`, by rejection: no trigonometry, hence the same bits everywhere.
void setRandomVelocity(Ball& ball, float speed, SplitMix64& random) noexcept;

/// One frame of straight flight in a cube from the origin to `side`; a ball whose centre has left the cube turns back.
void flyAndBounce(Ball& ball, float side) noexcept;

/// Half an edge between `least` and 10^`decades` times that, each decade as likely as any other. Computed in double and
/// rounded once, so that the last bit of the C library's exp has no effect.
float logUniform(double least, float decades, SplitMix64& random) noexcept;

/// Sorts balls into the order of their ids: along a Morton curve of 2^10 cells per side, or shuffled.
void orderBalls(std::vector<Ball>& balls, const BoxSceneOptions& options);
}  // namespace cullet
