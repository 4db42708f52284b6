// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/losses/box_losses.h"
#include "cullet/demos/bench/losses/loss_case.h"
#include "cullet/demos/bench/losses/query_losses.h"
#include "cullet/demos/bench/losses/spot_losses.h"
#include "cullet/demos/bench/losses/tiny_steps.h"
#include "cullet/demos/bench/losses/world_losses.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
std::vector<LossCase> listedCases()
{
    constexpr LossMeasure kTime = LossMeasure::Time, kMemory = LossMeasure::Memory;
    const std::vector<std::string> broad = {"cullet", "dbvt", "dbvt-deferred"};
    // Deferred, DBVT finds the pairs of a ghost that moves at the end of a step in the next one.
    const std::vector<std::string> immediate = {"cullet", "dbvt"};
    const std::vector<std::string> narrow = {"cullet", "bullet"};
    const std::vector<std::string> whole = {"cullet", "broadphase"};
    return {
        {"ghosts", "two of three bodies move among ghosts at rest: setAabb and pairs", 30000, kTime, 1, broad,
         makeGhostsLoss},
        {"crowd", "characters with ghosts: broad phase of a step", 400, kTime, 1, immediate, makeCrowdLoss},
        {"far", "boxes of 10 cm in 2 m move 6,400 km from the origin: setAabb and pairs", 5000, kTime, 1.2,
         broad, makeFarLoss, true},
        {"far-memory", "the same: memory", 5000, kMemory, 1.2, broad, makeFarLoss, true},
        {"refused", "boxes of 1 m in 2 m move, a filter callback refuses all pairs: setAabb and pairs", 2000,
         kTime, 1, broad, makeRefusedLoss},
        {"refused-memory", "the same: memory", 2000, kMemory, 1, broad, makeRefusedLoss},
        {"mostly-refused", "the same, one pair in 16 is allowed: setAabb and pairs", 2000, kTime, 1, broad,
         makeMostlyRefusedLoss},
        {"mostly-refused-memory", "the same: memory", 2000, kMemory, 1, broad, makeMostlyRefusedLoss},
        {"masked", "boxes of 1 m in 2 m move, their masks refuse all pairs: setAabb and pairs", 2000, kTime,
         1, broad, makeMaskedLoss},
        {"ray-moving", "one ray a frame on bodies that all move: the ray", 100000, kTime, 1, broad,
         makeRayMovingLoss},
        {"rays-moving", "100 rays a frame on bodies that all move: the rays", 100000, kTime, 1, broad,
         makeRaysMovingLoss},
        {"ray-resting", "one ray a frame on bodies at rest, first ones included: the ray", 100000, kTime, 1,
         broad, makeRayRestingLoss},
        {"sweep-moving", "a box of a metre swept among bodies that all move, one a frame: the sweep", 100000,
         kTime, 1, broad, makeSweepMovingLoss},
        {"sweep-resting", "the same among bodies at rest, first one included", 100000, kTime, 1, broad,
         makeSweepRestingLoss},
        {"box-moving", "the bodies in a box of 2 m, of bodies that all move, one query a frame: the query",
         100000, kTime, 1, broad, makeBoxMovingLoss},
        {"box-resting", "the same of bodies at rest, first one included", 100000, kTime, 1, broad,
         makeBoxRestingLoss},
        {"memory", "a world of 100 bodies that move: memory", 100, kMemory, 1.5, broad, makeDriftLoss},
        {"heap", "a heap at rest, slowest of the frames 2 to 9 after its creation", 64000, kTime, 3, broad,
         makeHeapLoss},
        {"planning", "10 links teleport among static boxes: setAabb, pairs, processAllOverlappingPairs", 1010,
         kTime, 1, broad, makePlanningLoss},
        {"planning-steps", "10 links move by up to 2 cm among static boxes: the same", 1010, kTime, 1, broad,
         makePlanningStepsLoss},
        {"planning-filters",
         "10 links teleport, one is cleaned from its pairs and created with other filters: all of it", 1010,
         kTime, 1, broad, makePlanningFiltersLoss},
        {"planning-start", "construction with these boxes, and 20 checks of links that teleport", 1010, kTime,
         1, broad, makePlanningFromConstructionLoss},
        {"construction", "construction with bodies, first pairs, destruction", 100, kTime, 1, broad,
         makeConstructionLoss},
        {"tiny", "a world of 14 bodies that move: setAabb and pairs", 14, kTime, 1, broad, makeDriftLoss},
        {"tiny-2", "a world of 2 bodies that move: setAabb and pairs", 2, kTime, 1, broad, makeDriftLoss},
        {"wall", "a wall falls apart: broad phase of a step", 1000, kTime, 1, broad, makeWallLoss},
        {"wall-step", "a wall falls apart: whole step", 1000, kTime, 1, broad, makeWallStepLoss},
        {"dispatcher-mesh", "Dispatcher with DBVT, bodies on a mesh: whole step", 4410, kTime, 1, narrow,
         makeMeshStepLoss},
        {"dispatcher-boxes", "Dispatcher with DBVT, boxes fall: whole step", 32000, kTime, 1, narrow,
         makeBoxesStepLoss},
        {"dispatcher-pyramid", "Dispatcher with DBVT, pyramid of boxes: whole step", 1240, kTime, 1, narrow,
         makePyramidStepLoss},
        {"all-boxes", "all of cullet against Broadphase alone, boxes fall: whole step", 32000, kTime, 1,
         whole, makeAllBoxesLoss},
        {"cylinders", "cylinders lie on a mesh: dispatch", 200, kTime, 1, narrow, makeCylindersLoss},
        {"compounds", "compounds of 50 hulls lie on a mesh: dispatch", 20, kTime, 1, narrow,
         makeCompoundsLoss},
        {"gimpact", "GImpact tori lie on a mesh: dispatch", 20, kTime, 1, narrow, makeGImpactLoss},
        {"cloth-hulls", "cloths on hulls: step", 4, kTime, 1.05, narrow, makeClothsOnHullsLoss},
        {"cloth-mesh", "cloths on a mesh: step", 4, kTime, 1.05, narrow, makeClothsOnMeshLoss},
    };
}
}  // namespace

const std::vector<LossCase>& lossCases()
{
    static const std::vector<LossCase> cases = []
    {
        std::vector<LossCase> all = listedCases();
        addSpots(all);
        addTinySteps(all);
        return all;
    }();
    return cases;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
