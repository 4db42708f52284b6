// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/broad_options.h"
#include "cullet/demos/scenes/box_scene.h"

#include <memory>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Benchmark "broad.update": a scene of boxes frame by frame, all backends on the same boxes.
///
/// In each frame every backend receives the boxes and finds the pairs, in an order that rotates from frame to frame.
/// First warm-up frames, then timed ones; a backend that exceeds the budget has fewer of both (never fewer than one
/// warm-up and three timed ones, unless the user interrupts), and its column `frames` says so. The overlapping pairs
/// are compared in the first, the middle and the last timed frame of each backend: with the exact pairs up to 150,000
/// bodies, beyond that with the pairs of the first backend in that frame. Columns pairs and hash are those of the last
/// comparison, in frame `hash_frame` of the scene; rows with the same frame have the same hash. A rival with wrong
/// pairs continues, and column `wrong_checks` of its row counts them.
///
/// @throws ProgramError (kExitDisagreement) when a backend's pairs are wrong, naming it and the frame
void runFramesBench(const BroadCase& benchCase, ResultFile& file);

/// A case and its scene, which need not be one of boxScenes().
struct FramesCase
{
    BroadCase benchCase;
    std::unique_ptr<BoxScene> scene;
};

/// runFramesBench() for several cases in turn, a frame of each, so that their times can be compared on a busy machine.
///
/// @return the rows of each case
/// @throws ProgramError as runFramesBench()
std::vector<std::vector<Json>> measureInTurn(std::vector<FramesCase>& cases);
}  // namespace CULLET_PRECISION
}  // namespace cullet
