// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/box_scene.h"

#include <memory>

namespace cullet
{
// Scenes in which grids, sorted axes and trees divide nothing. Unless stated otherwise, cubes of edge 2 that fly 0.05
// to 0.1 per frame and turn back at the ends of the room that contains their centres.

/// Centres uniform in a cube of edge 3, about a cell of a grid: seven of ten pairs of bodies overlap.
std::unique_ptr<BoxScene> makeOneCellScene(const BoxSceneOptions& options);

/// Centres uniform on the x axis, two per unit, and moving along it: four pairs per body.
std::unique_ptr<BoxScene> makeLineScene(const BoxSceneOptions& options);

/// The line along (1, 1, 1), oblique to every axis: four pairs per body.
std::unique_ptr<BoxScene> makeDiagonalScene(const BoxSceneOptions& options);

/// All centres at one point, which moves: every pair of bodies overlaps.
std::unique_ptr<BoxScene> makeOnePointScene(const BoxSceneOptions& options);

/// Spheres of radius 1, 32 units of volume each, and one body whose box contains all others: two pairs per body.
std::unique_ptr<BoxScene> makeCoverScene(const BoxSceneOptions& options);

/// Edges log-uniform from 0.001 to 1,000, eight million units of volume each: about four pairs per body. All move 0.05
/// to 0.1 of their half edge per frame, or a millionth of the room if that is more, so that floats represent the
/// motion.
std::unique_ptr<BoxScene> makeSixDecadesScene(const BoxSceneOptions& options);

/// Cubes uniform in a cube whose size gives about `pairs` overlapping pairs in total: the counterpart of an extreme
/// scene.
std::unique_ptr<BoxScene> makeBalancedScene(const BoxSceneOptions& options, double pairs);
}  // namespace cullet
