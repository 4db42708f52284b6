// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// When World solves islands on several threads and when it does not, and what it leaves to classes of the application.
#include "cullet/plugin/shapes/shape_boxes.h"
#include "cullet/plugin/solver.h"
#include "cullet/plugin/step/split_impulse_row.h"
#include "cullet/plugin/world.h"
#include "cullet/tests/plugin/world/step_stage.h"

#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <BulletDynamics/MLCPSolvers/btDantzigSolver.h>
#include <BulletDynamics/MLCPSolvers/btMLCPSolver.h>
#include <LinearMath/btQuickprof.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <new>
#include <thread>

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace cullet::test
{
namespace
{
using Serial = btDiscreteDynamicsWorld;
using Parallel = World<btDiscreteDynamicsWorld>;

NamedScene sceneNamed(const std::string& name)
{
    for (const NamedScene& scene : allScenes())
    {
        if (name == scene.name)
            return scene;
    }
    ADD_FAILURE() << "no scene " << name;
    return allScenes().front();
}

/// Steps many piles in both worlds; `prepare` is called for either before.
template <class Prepare>
SerialIslands reasonAfter(const Prepare& prepare)
{
    const NamedScene scene = sceneNamed("ManyPiles");
    Stage<Serial> bullet;
    Stage<Parallel> own;
    own.world.setUpdateThreads(3);
    const auto inBullet = scene.make(bullet.world), inOwn = scene.make(own.world);
    prepare(bullet.world);
    prepare(own.world);
    for (int step = 0; step < 60; ++step)
    {
        inBullet->step(step);
        inOwn->step(step);
        EXPECT_EQ(inOwn->hash(), inBullet->hash()) << step;
    }
    return own.world.islandStats().serial;
}

TEST(WorldIslands, SolveOnSeveralThreadsByDefault)
{
    EXPECT_EQ(reasonAfter([](Serial&) {}), SerialIslands::No);
}

TEST(WorldIslands, LeaveOneThreadAlone)
{
    const auto oneThread = [](Serial& world)
    {
        if (auto* own = dynamic_cast<Parallel*>(&world))
            own->setUpdateThreads(1);
    };
    EXPECT_EQ(reasonAfter(oneThread), SerialIslands::FewThreads);
}

TEST(WorldIslands, KeepOneSequenceOfRandomNumbers)
{
    const auto shuffle = [](Serial& world) { world.getSolverInfo().m_solverMode |= SOLVER_RANDMIZE_ORDER; };
    EXPECT_EQ(reasonAfter(shuffle), SerialIslands::RandomOrder);
}

TEST(WorldIslands, LeaveUnsplitIslandsToBullet)
{
    const auto unite = [](Serial& world) { world.getSimulationIslandManager()->setSplitIslands(false); };
    EXPECT_EQ(reasonAfter(unite), SerialIslands::NotSplit);
}

/// Calls of a profile function on other threads than the test's.
class CountingProfiler
{
public:
    CountingProfiler()
    {
        caller() = std::this_thread::get_id();
        foreignZones() = 0;
        btSetCustomEnterProfileZoneFunc([](const char*)
                                        { foreignZones() += std::this_thread::get_id() != caller(); });
    }
    ~CountingProfiler() { btSetCustomEnterProfileZoneFunc(m_before); }
    static std::atomic<int>& foreignZones()
    {
        static std::atomic<int> zones;
        return zones;
    }

private:
    static std::thread::id& caller()
    {
        static std::thread::id id;
        return id;
    }
    btEnterProfileZoneFunc* m_before = btGetCurrentEnterProfileZoneFunc();
};

TEST(WorldIslands, CallCustomProfilerOnCallingThreadUnlessItIsThreadSafe)
{
    const CountingProfiler profiler;
    EXPECT_EQ(reasonAfter([](Serial&) {}), SerialIslands::Profiler);
    EXPECT_EQ(CountingProfiler::foreignZones(), 0);
    const auto allow = [](Serial& world)
    {
        if (auto* own = dynamic_cast<Parallel*>(&world))
            own->setThreadSafeProfiler(true);
    };
    EXPECT_EQ(reasonAfter(allow), SerialIslands::No);
}

/// A solver of the application.
class OwnSolver : public btSequentialImpulseConstraintSolver
{
};

TEST(WorldIslands, CallForeignSolversOnCallingThread)
{
    std::vector<std::unique_ptr<btConstraintSolver>> solvers;
    const auto useOwn = [&](Serial& world)
    {
        solvers.push_back(std::make_unique<OwnSolver>());
        world.setConstraintSolver(solvers.back().get());
    };
    EXPECT_EQ(reasonAfter(useOwn), SerialIslands::ForeignSolver);
    btDantzigSolver dantzig;
    const auto useMlcp = [&](Serial& world)
    {
        solvers.push_back(std::make_unique<btMLCPSolver>(&dantzig));
        world.setConstraintSolver(solvers.back().get());
    };
    EXPECT_EQ(reasonAfter(useMlcp), SerialIslands::ForeignSolver);
}

/// A class of the application that might solve groups in its own way.
class DerivedSolver : public Solver
{
};

TEST(WorldIslands, GiveAllGroupsToCulletsSolverButNotToAClassDerivedFromIt)
{
    std::vector<std::unique_ptr<Solver>> solvers;
    const auto use = [&](auto solver)
    {
        return [&solvers, solver](Serial& world)
        {
            solvers.push_back(solver());
            world.setConstraintSolver(solvers.back().get());
        };
    };
    EXPECT_EQ(reasonAfter(use([] { return std::make_unique<Solver>(); })), SerialIslands::OwnSolver);
    EXPECT_GT(solvers.back()->stats().groups, 1u) << "of the whole step";
    EXPECT_EQ(reasonAfter(use([] { return std::make_unique<DerivedSolver>(); })),
              SerialIslands::ForeignSolver);
    EXPECT_LE(solvers.back()->stats().groups, 1u) << "group by group";
}

/// A joint of the application, which counts calls on other threads than the one that made it.
class OwnJoint : public btPoint2PointConstraint
{
public:
    using btPoint2PointConstraint::btPoint2PointConstraint;
    void getInfo1(btConstraintInfo1* info) override
    {
        ++calls;
        foreignCalls += std::this_thread::get_id() != m_maker;
        btPoint2PointConstraint::getInfo1(info);
    }
    int calls = 0;
    std::atomic<int> foreignCalls{0};

private:
    std::thread::id m_maker = std::this_thread::get_id();
};

TEST(WorldIslands, CallForeignJointsOnCallingThread)
{
    std::vector<std::unique_ptr<OwnJoint>> joints;
    const auto addJoint = [&](Serial& world)
    {
        joints.push_back(std::make_unique<OwnJoint>(*world.getNonStaticRigidBodies()[0], vec(0, 1, 0)));
        world.addConstraint(joints.back().get());
    };
    EXPECT_EQ(reasonAfter(addJoint), SerialIslands::ForeignJoint);
    for (const auto& joint : joints)
    {
        EXPECT_GT(joint->calls, 10);
        EXPECT_EQ(joint->foreignCalls, 0);
    }
}

TEST(WorldIslands, CallForeignRowFunctionsOnCallingThread)
{
    static std::thread::id caller;
    static std::atomic<int> calls, foreignCalls;
    static btSingleConstraintRowSolver bullets = nullptr;
    caller = std::this_thread::get_id();
    const auto setRow = [&](Serial& world)
    {
        // The first step with a solver mode sets Bullet's functions.
        world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
        auto& solver = static_cast<btSequentialImpulseConstraintSolver&>(*world.getConstraintSolver());
        bullets = solver.getActiveConstraintRowSolverLowerLimit();
        solver.setConstraintRowSolverLowerLimit(
            [](btSolverBody& a, btSolverBody& b, const btSolverConstraint& row)
            {
                ++calls;
                foreignCalls += std::this_thread::get_id() != caller;
                return bullets(a, b, row);
            });
    };
    EXPECT_EQ(reasonAfter(setRow), SerialIslands::ForeignRows);
    EXPECT_GT(calls, 1000);
    EXPECT_EQ(foreignCalls, 0);
}

TEST(WorldIslands, ForgetRowFunctionsThatWereSetBeforeFirstStep)
{
    const auto setRow = [](Serial& world)
    {
        auto& solver = static_cast<btSequentialImpulseConstraintSolver&>(*world.getConstraintSolver());
        solver.setConstraintRowSolverGeneric([](btSolverBody&, btSolverBody&, const btSolverConstraint&)
                                             { return btScalar(0); });
    };
    EXPECT_EQ(reasonAfter(setRow), SerialIslands::No) << "Bullet replaces it in the first step";
}

TEST(WorldIslands, ShareTaskWhenTheyShareBody)
{
    EXPECT_GT(run<Parallel>(sceneNamed("SharedPlates"), 60, 3).mostSharing, 10u);
    EXPECT_GT(run<Parallel>(sceneNamed("OddJoints"), 60, 3).mostSharing, 10u);
    EXPECT_EQ(run<Parallel>(sceneNamed("Pyramids"), 60, 3).mostSharing, 0u);
}

#if defined(__SSE2__)
TEST(WorldIslands, RoundAsCallingThreadDoes)
{
    // Other threads flush tiny numbers and round up too, where the application's thread does.
    const unsigned usual = _mm_getcsr();
    const auto expected = run<Serial>(sceneNamed("ManyPiles"), 60, 0).hashes;
    _mm_setcsr(usual | _MM_FLUSH_ZERO_ON | _MM_ROUND_UP);
    const auto roundedUp = run<Serial>(sceneNamed("ManyPiles"), 60, 0).hashes;
    const History own = run<Parallel>(sceneNamed("ManyPiles"), 60, 3);
    _mm_setcsr(usual);
    EXPECT_NE(roundedUp, expected);
    EXPECT_EQ(own.hashes, roundedUp);
    EXPECT_GT(own.mostTasks, 1u);
}
#endif

TEST(WorldBodies, AreSweptOnlyWithThreshold)
{
    EXPECT_GT(run<Parallel>(sceneNamed("Bullets"), 60, 3).swept, 100u);
    EXPECT_EQ(run<Parallel>(sceneNamed("Ragdolls"), 60, 3).swept, 0u);
}

TEST(SplitImpulseRow, HasBulletsRounding)
{
    EXPECT_NE(splitImpulseRowOfBullet(false), nullptr);
    EXPECT_NE(splitImpulseRowOfBullet(true), nullptr);
}

// Else each box would be computed by Bullet's virtual function.
TEST(ShapeBoxes, HaveBulletsRounding)
{
    EXPECT_TRUE(hasBulletsBoxes());
}

/// A world of the application that keeps functions of its own, one of them private.
class OwnWorld : public btDiscreteDynamicsWorld
{
public:
    using btDiscreteDynamicsWorld::btDiscreteDynamicsWorld;
    void solveConstraints(btContactSolverInfo& info) override
    {
        ++solved;
        btDiscreteDynamicsWorld::solveConstraints(info);
    }
    int solved = 0, activated = 0;

private:
    void updateActivationState(btScalar timeStep) override
    {
        ++activated;
        btDiscreteDynamicsWorld::updateActivationState(timeStep);
    }
};

TEST(WorldLayers, KeepFunctionsOfApplication)
{
    Stage<World<OwnWorld>> own;
    Stage<Serial> bullet;
    const NamedScene scene = sceneNamed("ManyPiles");
    const auto inOwn = scene.make(own.world), inBullet = scene.make(bullet.world);
    for (int step = 0; step < 60; ++step)
    {
        inOwn->step(step);
        inBullet->step(step);
    }
    EXPECT_EQ(inOwn->hash(), inBullet->hash());
    EXPECT_EQ(own.world.solved, 60);
    EXPECT_EQ(own.world.activated, 60);
    EXPECT_EQ(own.world.islandStats().groups, 0u);
}

/// Memory of Bullet, of which one allocation by the solver fails.
class FailingMemory
{
public:
    explicit FailingMemory(int allocations)
    {
        isSolving() = false;
        left() = allocations;
        btAlignedAllocSetCustom(allocate, std::free);
        btSetCustomEnterProfileZoneFunc(
            [](const char* zone)
            {
                if (std::strcmp(zone, "processIslands") == 0)
                    isSolving() = true;
                if (std::strcmp(zone, "integrateTransforms") == 0)
                    isSolving() = false;
            });
    }
    ~FailingMemory()
    {
        btAlignedAllocSetCustom(nullptr, nullptr);
        btSetCustomEnterProfileZoneFunc(m_profiler);
    }

    static void stopSolving() { isSolving() = false; }

private:
    static std::atomic<bool>& isSolving()
    {
        static std::atomic<bool> solving;
        return solving;
    }
    static std::atomic<int>& left()
    {
        static std::atomic<int> allocations;
        return allocations;
    }
    static void* allocate(std::size_t size)
    {
        if (isSolving() && left().fetch_sub(1) == 1)
            throw std::bad_alloc();
        return std::malloc(size);
    }
    btEnterProfileZoneFunc* m_profiler = btGetCurrentEnterProfileZoneFunc();
};

/// Steps many piles while one allocation of the solver fails; returns how many steps threw.
int stepsThatThrow(int allocations)
{
    Stage<Parallel> stage;
    stage.world.setUpdateThreads(3);
    stage.world.setThreadSafeProfiler(true);
    const auto scene = sceneNamed("ManyPiles").make(stage.world);
    int thrown = 0;
    {
        const FailingMemory memory(allocations);
        for (int step = 0; step < 20; ++step)
        {
            try
            {
                scene->step(step);
            }
            catch (const std::bad_alloc&)
            {
                memory.stopSolving();
                ++thrown;
            }
        }
    }
    scene->step(20);
    EXPECT_GT(stage.world.islandStats().tasks, 1u);
    return thrown;
}

TEST(WorldIslands, ThrowToCallerWhatThreadThrowsAndStepOn)
{
    for (const int allocations : {1, 2, 5, 9, 14})
        EXPECT_EQ(stepsThatThrow(allocations), 1) << allocations;
}
}  // namespace
}  // namespace cullet::test
