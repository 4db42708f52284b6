// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/box_scene.h"

#include <memory>

namespace cullet
{
// Conical heaps (slope 0.6) stacked layer on layer, each layer shifted at random, without physics.

/// A settled heap of resting unit boxes: about 3.1 pairs per body. In each frame every box is within 0.01 of its place
/// on each axis, so that no box leaves a margin of 0.05.
std::unique_ptr<BoxScene> makeSettledHeapScene(const BoxSceneOptions& options);

/// The settled heap while it forms: bodies start up to 32 above their places, fall along y, 0.25 per frame, and jitter
/// by 0.01 while falling and at rest; all rest after 128 frames. More and more bounds are at equal heights, the bad
/// case of sweep and prune along y.
std::unique_ptr<BoxScene> makeSettlingHeapScene(const BoxSceneOptions& options);

/// A dense heap of rotated unit boxes, whose bounds have edges from 1 to 1.52: about 7.6 pairs per body. Every body
/// drifts a few hundredths around its place.
std::unique_ptr<BoxScene> makeDriftingHeapScene(const BoxSceneOptions& options);
}  // namespace cullet
