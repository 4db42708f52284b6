// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/losses/loss_case.h"

#include <memory>

// Cases of broad phases without a world.
namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The first third of the bodies of scene W1 are ghosts (btGhostObject) at rest, the others move.
std::unique_ptr<LossSide> makeGhostsLoss(const LossSetup& setup);

/// Boxes of 10 cm in a cube of 2 m, 6,400 km from the origin along each axis, all of which move.
std::unique_ptr<LossSide> makeFarLoss(const LossSetup& setup);

/// Boxes of 1 m in a cube of 2 m, all of which move, with a filter callback that refuses all pairs.
std::unique_ptr<LossSide> makeRefusedLoss(const LossSetup& setup);

/// The same boxes without a callback; their filter words refuse all pairs.
std::unique_ptr<LossSide> makeMostlyRefusedLoss(const LossSetup& setup);

std::unique_ptr<LossSide> makeMaskedLoss(const LossSetup& setup);

/// Scene W1, 20 frames a run.
std::unique_ptr<LossSide> makeDriftLoss(const LossSetup& setup);

/// A new broad phase in each run, with the heap of scene W4. The time is that of the slowest frame after the first.
std::unique_ptr<LossSide> makeHeapLoss(const LossSetup& setup);

/// The loop of motion planners: no world, gDbvtMargin = 0, static boxes and 10 links with filter words of their own.
/// 200 poses a run, each in another place.
std::unique_ptr<LossSide> makePlanningLoss(const LossSetup& setup);

/// The same with links that move by up to 2 cm on each axis.
std::unique_ptr<LossSide> makePlanningStepsLoss(const LossSetup& setup);

/// A new broad phase in each run, with 20 of these poses.
std::unique_ptr<LossSide> makePlanningFiltersLoss(const LossSetup& setup);

std::unique_ptr<LossSide> makePlanningFromConstructionLoss(const LossSetup& setup);

/// Ten broad phases a run, each created with its bodies and destroyed.
std::unique_ptr<LossSide> makeConstructionLoss(const LossSetup& setup);
}  // namespace CULLET_PRECISION
}  // namespace cullet
