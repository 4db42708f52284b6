// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Steps of World<btDiscreteDynamicsWorld> in which one allocation fails, for each allocation: Bullet's own function runs
// instead, with the same bits.
#include "cullet/tests/plugin/world/step_stage.h"
#include "cullet/tests/support/process/failing_new.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
/// A world in which allocation number `after` of the functions that World takes over fails.
class FaultyWorld : public World<btDiscreteDynamicsWorld>
{
public:
    using World<btDiscreteDynamicsWorld>::World;
    void solveConstraints(btContactSolverInfo& info) override
    {
        fail([&] { World::solveConstraints(info); });
    }
    void applyGravity() override
    {
        fail([&] { World::applyGravity(); });
    }

    std::uint64_t after = 0;
    bool hasFailed = false;

protected:
    void calculateSimulationIslands() override
    {
        fail([&] { World::calculateSimulationIslands(); });
    }
    void predictUnconstraintMotion(btScalar timeStep) override
    {
        fail([&] { World::predictUnconstraintMotion(timeStep); });
    }
    void integrateTransforms(btScalar timeStep) override
    {
        fail([&] { World::integrateTransforms(timeStep); });
    }

private:
    template <class Function>
    void fail(const Function& function)
    {
        if (hasFailed)
        {
            function();
            return;
        }
        const std::uint64_t before = newCount();
        const OneNewFails failing(after);
        function();
        hasFailed = failing.hasHappened();
        after -= hasFailed ? 0 : newCount() - before;
    }
};

constexpr int kSteps = 4;

/// No body touches another: there are as many islands as bodies, and each is a group.
class LoneBodies : public StepScene
{
public:
    explicit LoneBodies(btDiscreteDynamicsWorld& world) : StepScene(world)
    {
        world.getSolverInfo().m_minimumSolverBatchSize = 1;
        btSphereShape& ball = makeShape<btSphereShape>(btScalar(0.5));
        for (int i = 0; i < 16; ++i)
            addBody(ball, 1, vec(3 * i, 5, 0));
    }
    int events() const override { return static_cast<int>(bodies().size()); }
};

/// @param prepare called with the number of each step
template <class StageT, class Prepare>
std::vector<std::uint64_t> hashesOf(MakeScene make, StageT& stage, const Prepare& prepare)
{
    const auto scene = make(stage.world);
    std::vector<std::uint64_t> hashes;
    for (int step = 0; step < kSteps; ++step)
    {
        prepare(step);
        scene->step(step);
        hashes.push_back(scene->hash());
    }
    return hashes;
}

/// @return allocations
std::uint64_t checkThatEachMayFail(MakeScene make)
{
    Stage<btDiscreteDynamicsWorld> bullet;
    const auto expected = hashesOf(make, bullet, [](int) {});
    std::uint64_t failed = 0, parallel = 0;
    for (bool hasFailed = true; hasFailed; ++failed)
    {
        Stage<FaultyWorld> own;
        own.world.after = failed;
        // In step 2 other threads take over, which need memory of their own.
        const auto setThreads = [&own](int step)
        {
            if (step % 2 == 0)
                own.world.setUpdateThreads(step == 0 ? 3 : 2);
        };
        EXPECT_EQ(hashesOf(make, own, setThreads), expected) << "without allocation " << failed;
        const SerialIslands reason = own.world.islandStats().serial;
        EXPECT_TRUE(reason == SerialIslands::No || reason == SerialIslands::NoMemory) << int(reason);
        parallel += reason == SerialIslands::No;
        hasFailed = own.world.hasFailed;
    }
    EXPECT_GT(parallel, failed / 2) << "the next steps have memory again";
    return failed;
}

TEST(WorldMemory, StepsAsBulletWhenAnyAllocationFails)
{
    // Islands, joints and a shared body.
    EXPECT_GT(checkThatEachMayFail(jointScenes()[1].make), 15u);
}

TEST(WorldMemory, StepsAsBulletWhenAnyAllocationFailsAndEachBodyIsAGroup)
{
    EXPECT_GT(checkThatEachMayFail(makeScene<LoneBodies>), 10u);
}
}  // namespace
}  // namespace cullet::test
