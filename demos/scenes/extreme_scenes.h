// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/box_scene.h"

#include <memory>

namespace cullet
{
// Where grids, sorted axes and trees have nothing to divide. Cubes of edge 2 unless said otherwise, which all fly 0.05 to
// 0.1 a frame and turn back at the ends of the room that holds their centres.

/// Centres uniform in a cube of edge 3, about a cell of a grid: seven of ten pairs of bodies overlap.
std::unique_ptr<BoxScene> makeOneCellScene(const BoxSceneOptions& options);

/// Centres uniform on the x axis, two a unit, and stay on it: four pairs per body.
std::unique_ptr<BoxScene> makeLineScene(const BoxSceneOptions& options);

/// The line along (1, 1, 1), oblique to every axis: four pairs per body.
std::unique_ptr<BoxScene> makeDiagonalScene(const BoxSceneOptions& options);

/// All centres at one point, which moves: every pair of bodies overlaps.
std::unique_ptr<BoxScene> makeOnePointScene(const BoxSceneOptions& options);

/// Spheres of radius 1, 32 units of volume each, but for one body whose box holds all others: two pairs per body.
std::unique_ptr<BoxScene> makeCoverScene(const BoxSceneOptions& options);

/// Edges log-uniform from 0.001 to 1,000, eight million units of volume each: about four pairs per body. All move 0.05 to
/// 0.1 of their half edge a frame, or a millionth of the room where that is more, so that floats can tell.
std::unique_ptr<BoxScene> makeSixDecadesScene(const BoxSceneOptions& options);

/// Cubes uniform in a cube whose size gives about `pairs` overlapping pairs in all: what an extreme scene is compared with.
std::unique_ptr<BoxScene> makeBalancedScene(const BoxSceneOptions& options, double pairs);
}  // namespace cullet
