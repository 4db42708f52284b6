// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/losses/world_losses.h"

#include "cullet/demos/bench/losses/cloths_on_shapes.h"
#include "cullet/demos/bench/losses/shapes_on_mesh.h"
#include "cullet/demos/drop/pair_audit.h"
#include "cullet/demos/scenes/bodies/world_scene.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
enum class Timed
{
    BroadPhase,
    Dispatch,
    Step
};

double millisecondsOf(Timed timed, const PhaseTimes& times)
{
    const auto of = [&](Phase phase) { return times[static_cast<std::size_t>(phase)]; };
    if (timed == Timed::BroadPhase)
        return of(Phase::UpdateAabbs) + of(Phase::CalculateOverlappingPairs);
    if (timed == Timed::Dispatch)
        return of(Phase::Dispatch);
    double sum = 0.0;
    for (const double phase : times)
        sum += phase;
    return sum;
}

class WorldLoss : public LossSide
{
public:
    /// @param skipped steps before the first run
    /// @param steps   in each run
    WorldLoss(std::unique_ptr<WorldScene> scene, Timed timed, int skipped, int steps = 10)
        : m_scene(std::move(scene)), m_timed(timed), m_steps(steps)
    {
        for (int step = 0; step < skipped; ++step)
            m_scene->step();
    }

    double run() override
    {
        double milliseconds = 0.0;
        for (int step = 0; step < m_steps; ++step)
            milliseconds += millisecondsOf(m_timed, m_scene->step());
        return milliseconds;
    }

    PairDigest answer() override { return digestCache(m_scene->world()); }
    PairDigest exactAnswer() override { return digestExact(collectProxies(m_scene->world())); }

private:
    std::unique_ptr<WorldScene> m_scene;
    Timed m_timed;
    int m_steps;
};

/// The parts of cullet are none: Bullet's world and dispatcher with DBVT.
WorldSceneOptions stockOptions(const LossSetup& setup)
{
    WorldSceneOptions options;
    options.bodies = setup.bodies;
    options.seed = setup.seed;
    options.sleeping = false;
    options.backend = "dbvt";
    options.threads = setup.threads;
    return options;
}

std::unique_ptr<LossSide> makeBroadLoss(const char* scene, const LossSetup& setup, Timed timed, int skipped)
{
    WorldSceneOptions options = stockOptions(setup);
    options.backend = setup.side == "cullet" ? "grid" : setup.side;
    return std::make_unique<WorldLoss>(makeWorldScene(scene, options), timed, skipped);
}

/// Steps of scene "wall" until its bricks have come apart.
constexpr int kUntilScattered = 150;

/// Steps of scene "boxes" in a run: each takes half a second.
constexpr int kStepsOfBoxes = 2;

WorldSceneOptions narrowOptions(const LossSetup& setup)
{
    WorldSceneOptions options = stockOptions(setup);
    options.narrow = setup.side == "cullet" ? "dispatcher" : "bullet";
    return options;
}

std::unique_ptr<LossSide> makeNarrowLoss(const char* scene, const LossSetup& setup, int skipped)
{
    return std::make_unique<WorldLoss>(makeWorldScene(scene, narrowOptions(setup)), Timed::Step, skipped);
}

std::unique_ptr<LossSide> makeClothsLoss(ClothGround ground, const LossSetup& setup)
{
    constexpr int kUntilDraped = 60;
    return std::make_unique<WorldLoss>(makeClothsOnShapes(ground, narrowOptions(setup)), Timed::Step,
                                       kUntilDraped);
}

std::unique_ptr<LossSide> makeShapesLoss(MeshShape shape, const LossSetup& setup)
{
    constexpr int kUntilRest = 60;
    return std::make_unique<WorldLoss>(makeShapesOnMesh(shape, narrowOptions(setup)), Timed::Dispatch,
                                       kUntilRest);
}
}  // namespace

std::unique_ptr<LossSide> makeCrowdLoss(const LossSetup& setup)
{
    return makeBroadLoss("crowd", setup, Timed::BroadPhase, 0);
}

std::unique_ptr<LossSide> makeWallLoss(const LossSetup& setup)
{
    return makeBroadLoss("wall", setup, Timed::BroadPhase, kUntilScattered);
}

std::unique_ptr<LossSide> makeWallStepLoss(const LossSetup& setup)
{
    return makeBroadLoss("wall", setup, Timed::Step, kUntilScattered);
}

std::unique_ptr<LossSide> makeMeshStepLoss(const LossSetup& setup)
{
    constexpr int kUntilLanded = 120;
    return makeNarrowLoss("convex-mesh", setup, kUntilLanded);
}

std::unique_ptr<LossSide> makeBoxesStepLoss(const LossSetup& setup)
{
    return std::make_unique<WorldLoss>(makeWorldScene("boxes", narrowOptions(setup)), Timed::Step, 10,
                                       kStepsOfBoxes);
}

std::unique_ptr<LossSide> makePyramidStepLoss(const LossSetup& setup)
{
    return makeNarrowLoss("pyramid", setup, 10);
}

std::unique_ptr<LossSide> makeAllBoxesLoss(const LossSetup& setup)
{
    WorldSceneOptions options = stockOptions(setup);
    options.backend = "grid";
    options.narrow = setup.side == "cullet" ? "dispatcher" : "bullet";
    options.update = setup.side == "cullet" ? "parallel" : "bullet";
    return std::make_unique<WorldLoss>(makeWorldScene("boxes", options), Timed::Step, 10, kStepsOfBoxes);
}

std::unique_ptr<LossSide> makeCylindersLoss(const LossSetup& setup)
{
    return makeShapesLoss(MeshShape::Cylinder, setup);
}

std::unique_ptr<LossSide> makeCompoundsLoss(const LossSetup& setup)
{
    return makeShapesLoss(MeshShape::CompoundOfHulls, setup);
}

std::unique_ptr<LossSide> makeGImpactLoss(const LossSetup& setup)
{
    return makeShapesLoss(MeshShape::GImpactTorus, setup);
}

std::unique_ptr<LossSide> makeClothsOnHullsLoss(const LossSetup& setup)
{
    return makeClothsLoss(ClothGround::Hulls, setup);
}

std::unique_ptr<LossSide> makeClothsOnMeshLoss(const LossSetup& setup)
{
    return makeClothsLoss(ClothGround::Mesh, setup);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
