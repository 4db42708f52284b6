// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/losses/loss_case.h"

#include <memory>

// Cases of Bullet worlds: some steps a run, of which the phases named here count. Their answer is the overlapping pairs.
namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Scene "crowd": updateAabbs and calculateOverlappingPairs.
std::unique_ptr<LossSide> makeCrowdLoss(const LossSetup& setup);

/// Scene "wall" after 150 steps, while its bricks come to rest: updateAabbs and calculateOverlappingPairs.
std::unique_ptr<LossSide> makeWallLoss(const LossSetup& setup);

/// Scene "wall" after 150 steps: whole steps.
std::unique_ptr<LossSide> makeWallStepLoss(const LossSetup& setup);

/// Scene "convex-mesh" with DBVT: whole steps, with cullet::Dispatcher or btCollisionDispatcher.
std::unique_ptr<LossSide> makeMeshStepLoss(const LossSetup& setup);

/// Scene "boxes" with DBVT: as makeMeshStepLoss().
std::unique_ptr<LossSide> makeBoxesStepLoss(const LossSetup& setup);

/// Scene "pyramid" with DBVT: as makeMeshStepLoss().
std::unique_ptr<LossSide> makePyramidStepLoss(const LossSetup& setup);

/// Scene "boxes": whole steps of all of cullet ("cullet"), or of Bullet's world and dispatcher with cullet::Broadphase
/// ("broadphase").
std::unique_ptr<LossSide> makeAllBoxesLoss(const LossSetup& setup);

/// Cylinders on their sides, on a mesh, with DBVT: dispatch.
std::unique_ptr<LossSide> makeCylindersLoss(const LossSetup& setup);

/// Compounds of 50 hulls, on a mesh, with DBVT: dispatch.
std::unique_ptr<LossSide> makeCompoundsLoss(const LossSetup& setup);

/// GImpact tori on a mesh, with DBVT: dispatch.
std::unique_ptr<LossSide> makeGImpactLoss(const LossSetup& setup);

/// Cloths on hulls, with DBVT: whole steps.
std::unique_ptr<LossSide> makeClothsOnHullsLoss(const LossSetup& setup);

/// Cloths on a mesh, with DBVT: whole steps.
std::unique_ptr<LossSide> makeClothsOnMeshLoss(const LossSetup& setup);
}  // namespace CULLET_PRECISION
}  // namespace cullet
