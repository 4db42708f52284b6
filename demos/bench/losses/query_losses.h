// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/losses/loss_case.h"

#include <memory>

// Cases of a few rays a frame on scene W1. The answer is which boxes a ray hits. The time is that of the rays alone, which
// includes what the broad phase builds for them.
namespace cullet
{
inline namespace CULLET_PRECISION
{
/// One ray a frame; all bodies move before it.
std::unique_ptr<LossSide> makeRayMovingLoss(const LossSetup& setup);

/// 100 rays a frame; all bodies move before them.
std::unique_ptr<LossSide> makeRaysMovingLoss(const LossSetup& setup);

/// One ray a frame on bodies that never move.
std::unique_ptr<LossSide> makeRayRestingLoss(const LossSetup& setup);

std::unique_ptr<LossSide> makeSweepMovingLoss(const LossSetup& setup);

std::unique_ptr<LossSide> makeSweepRestingLoss(const LossSetup& setup);

std::unique_ptr<LossSide> makeBoxMovingLoss(const LossSetup& setup);

std::unique_ptr<LossSide> makeBoxRestingLoss(const LossSetup& setup);
}  // namespace CULLET_PRECISION
}  // namespace cullet
