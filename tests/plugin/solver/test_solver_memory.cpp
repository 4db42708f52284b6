// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Groups for whose rows there is no memory: Bullet's solver solves them, with its bits.
#include "cullet/plugin/world.h"
#include "cullet/tests/plugin/solver/solver_scene.h"
#include "cullet/tests/support/process/failing_new.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
SolverOptions optionsOf(SolverModel model, int threads)
{
    SolverOptions options;
    options.model = model;
    options.threads = threads;
    return options;
}

/// One call of operator new fails in the first step.
class FaultySolver : public Solver
{
public:
    FaultySolver(SolverModel model, std::uint64_t after) : Solver(optionsOf(model, 1)), m_after(after) {}

    btScalar solveGroup(btCollisionObject** bodies, int bodyCount, btPersistentManifold** manifolds,
                        int manifoldCount, btTypedConstraint** joints, int jointCount,
                        const btContactSolverInfo& info, btIDebugDraw* debugDrawer,
                        btDispatcher* dispatcher) override
    {
        if (m_hasRun)
            return Solver::solveGroup(bodies, bodyCount, manifolds, manifoldCount, joints, jointCount, info,
                                      debugDrawer, dispatcher);
        m_hasRun = true;
        const OneNewFails failing(m_after);
        const btScalar result = Solver::solveGroup(bodies, bodyCount, manifolds, manifoldCount, joints,
                                                   jointCount, info, debugDrawer, dispatcher);
        hasFailed = failing.hasHappened();
        return result;
    }

    bool hasFailed = false;

private:
    std::uint64_t m_after;
    bool m_hasRun = false;
};

/// Boxes on each other, joined in pairs, in one island.
void addStack(SolverScene& scene, double x)
{
    btBoxShape& cube = scene.box(0.5, 0.5, 0.5);
    const std::size_t first = scene.bodies().size();
    for (int i = 0; i < 8; ++i)
        scene.add(cube, 1, vec(x + 0.1 * (i % 2), 0.49 + 0.98 * i, 0));
    for (std::size_t i = first; i + 1 < first + 8; i += 2)
        scene.join<btPoint2PointConstraint>(*scene.bodies()[i], *scene.bodies()[i + 1], vec(0, 0.5, 0),
                                            vec(0, -0.5, 0));
}

void buildStack(SolverScene& scene)
{
    scene.addFloor();
    addStack(scene, 0);
}

/// Hashes of a world whose first step Bullet's solver solves, and Solver the others.
std::vector<std::uint64_t> hashesAfterBulletsStep(SolverModel model, int steps)
{
    SolverScene scene(model == SolverModel::Bullet ? Contender::Bullet : Contender::Soft);
    buildStack(scene);
    btSequentialImpulseConstraintSolver bullets;
    std::vector<std::uint64_t> hashes;
    for (int i = 0; i < steps; ++i)
    {
        scene.world().setConstraintSolver(i == 0 ? &bullets : &scene.solver());
        scene.step();
        hashes.push_back(scene.hash());
    }
    return hashes;
}

TEST(SolverMemory, LeavesGroupToBulletWhenAnyAllocationFails)
{
    constexpr int kSteps = 4;
    for (const SolverModel model : {SolverModel::Bullet, SolverModel::Soft})
    {
        const std::vector<std::uint64_t> expected = hashesAfterBulletsStep(model, kSteps);
        std::uint64_t after = 0;
        for (bool hasFailed = true; hasFailed; ++after)
        {
            SolverScene scene(std::make_unique<FaultySolver>(model, after), 0, makeDiscreteWorld);
            buildStack(scene);
            const auto& solver = static_cast<FaultySolver&>(scene.solver());
            scene.step();
            hasFailed = solver.hasFailed;
            EXPECT_EQ(solver.stats().refusal, hasFailed ? SolverRefusal::NoMemory : SolverRefusal::No)
                << after;
            EXPECT_EQ(solver.stats().refusedGroups, hasFailed ? 1u : 0u) << after;
            for (int i = 0; hasFailed && i < kSteps; ++i)
            {
                EXPECT_EQ(scene.hash(), expected[std::size_t(i)]) << after << ", step " << i;
                scene.step();
                EXPECT_EQ(solver.stats().refusal, SolverRefusal::No) << after;
            }
        }
        EXPECT_GT(after, 15u);
    }
}

/// Hashes of two stacks after a step, of which the second one has contacts with a softness of their own.
struct TwoHashes
{
    explicit TwoHashes(std::unique_ptr<btSequentialImpulseConstraintSolver> solver)
        : scene(std::move(solver), 0, makeDiscreteWorld)
    {
        buildStack(scene);
        addStack(scene, 5);
        scene.bodies()[9]->setContactStiffnessAndDamping(2000, 100);
        scene.step();
        for (std::size_t i = 0; i < 16; ++i)
            ofStack[i / 8] = ofStack[i / 8] * 1099511628211ull + hashOf(*scene.bodies()[i + 1]);
    }

    SolverScene scene;
    std::uint64_t ofStack[2] = {};
};

TEST(SolverMemory, LeavesOnlyIslandsToBulletThatAreNotSolvedYet)
{
    const TwoHashes bullets(makeSolver(Contender::Stock)), own(makeSolver(Contender::Soft, 1));
    for (int i = 0; i < 2; ++i)
        ASSERT_NE(bullets.ofStack[i], own.ofStack[i]);
    int none = 0, second = 0;
    for (std::uint64_t after = 0;; ++after)
    {
        auto made = std::make_unique<FaultySolver>(SolverModel::Soft, after);
        const FaultySolver& solver = *made;
        const TwoHashes now(std::move(made));
        if (!solver.hasFailed)
            break;
        EXPECT_EQ(now.ofStack[1], bullets.ofStack[1]) << after;
        const bool isFirstSolved = now.ofStack[0] == own.ofStack[0];
        EXPECT_TRUE(isFirstSolved || now.ofStack[0] == bullets.ofStack[0]) << after;
        ++(isFirstSolved ? second : none);
    }
    EXPECT_GT(none, 10);
    EXPECT_GT(second, 0);
}

/// One call of operator new fails while the groups of a world are solved.
class FaultyTasks : public World<btDiscreteDynamicsWorld>
{
public:
    using World<btDiscreteDynamicsWorld>::World;
    void solveConstraints(btContactSolverInfo& info) override
    {
        const OneNewFails failing(after);
        World::solveConstraints(info);
        hasFailed = failing.hasHappened();
    }

    std::uint64_t after = 0;
    bool hasFailed = false;
};

/// How often an allocation failed, and how many groups the solver refused for it.
struct FailureCounts
{
    std::uint64_t failures = 0, refusals = 0;
};

FailureCounts failEachAllocationOfStep(int threads)
{
    FailureCounts counts;
    for (bool hasFailed = true; hasFailed; ++counts.failures)
    {
        FaultyTasks* world = nullptr;
        const auto makeWorld = [&](btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                                   btConstraintSolver* solver, btCollisionConfiguration* configuration)
        {
            auto made = std::make_unique<FaultyTasks>(dispatcher, broadphase, solver, configuration);
            world = made.get();
            return made;
        };
        SolverScene scene(std::make_unique<Solver>(optionsOf(SolverModel::Bullet, threads)), 0, makeWorld);
        scene.info().m_minimumSolverBatchSize = 1;
        scene.addFloor();
        btBoxShape& cube = scene.box(0.5, 0.5, 0.5);
        for (int i = 0; i < 12; ++i)
            scene.add(cube, 1, vec(2 * (i / 2), 0.49 + 0.98 * (i % 2), 0));
        scene.enter();
        world->after = counts.failures;
        scene.step();
        hasFailed = world->hasFailed;
        counts.refusals += static_cast<Solver&>(scene.solver()).stats().refusedGroups;
        world->after = ~std::uint64_t{0};
        scene.step(30);
        for (std::size_t i = 1; i < scene.bodies().size(); ++i)
            EXPECT_NEAR(heightOfBody(*scene.bodies()[i]), 0.5 + double((i - 1) % 2), 0.02) << counts.failures;
    }
    return counts;
}

TEST(SolverMemory, SolvesAllIslandsOfWorldWhenAnyAllocationFails)
{
    EXPECT_GT(failEachAllocationOfStep(2).failures, 15u);
    // On two threads the other one may have solved every group of which an allocation fails here.
    const FailureCounts onOneThread = failEachAllocationOfStep(1);
    EXPECT_GT(onOneThread.failures, 15u);
    EXPECT_GT(onOneThread.refusals, 0u);
}
}  // namespace
}  // namespace cullet::test
