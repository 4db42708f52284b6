// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Worlds of a few bodies: the work of a step that is not done, and that nothing else changes by that.
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/plugin/world.h"
#include "cullet/tests/plugin/body_hash.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace cullet::test
{
namespace
{
/// Cubes on a floor, far enough apart to sleep each by itself.
template <class W, class Made = btCollisionDispatcher>
class FewCubes
{
public:
    explicit FewCubes(int cubes)
    {
        add(m_floor, 0, vec(0, -1, 0));
        for (int i = 0; i < cubes; ++i)
            add(m_cube, 1, vec(3 * i, 0.5, 0));
    }
    ~FewCubes()
    {
        for (const auto& body : bodies)
            world.removeRigidBody(body.get());
    }
    FewCubes(const FewCubes&) = delete;
    FewCubes& operator=(const FewCubes&) = delete;

    void step(int count = 1)
    {
        for (int i = 0; i < count; ++i)
            world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
    }
    void push(std::size_t body)
    {
        bodies[body]->activate();
        bodies[body]->setLinearVelocity(vec(1, 2, 0));
    }
    /// Of all that a step changes in the bodies.
    std::vector<std::uint64_t> states() const
    {
        std::vector<std::uint64_t> states = {hashOfBodies(bodies)};
        for (const auto& body : bodies)
            states.push_back(std::uint64_t(body->getActivationState()));
        return states;
    }

private:
    void add(btCollisionShape& shape, double mass, const btVector3& at)
    {
        btVector3 inertia(0, 0, 0);
        if (mass > 0)
            shape.calculateLocalInertia(btScalar(mass), inertia);
        btRigidBody::btRigidBodyConstructionInfo info(btScalar(mass), nullptr, &shape, inertia);
        info.m_startWorldTransform.setOrigin(at);
        bodies.push_back(std::make_unique<btRigidBody>(info));
        world.addRigidBody(bodies.back().get());
    }

    btBoxShape m_floor{vec(50, 1, 50)}, m_cube{vec(0.5, 0.5, 0.5)};

public:
    btDefaultCollisionConfiguration configuration;
    Made dispatcher{&configuration};
    Broadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    W world{&dispatcher, &broadphase, &solver, &configuration};
    std::vector<std::unique_ptr<btRigidBody>> bodies;
};

using StockCubes = FewCubes<btDiscreteDynamicsWorld>;
using OwnCubes = FewCubes<World<btDiscreteDynamicsWorld>>;
constexpr int kUntilAsleep = 300;

void expectSameAnalytics(const btSolverAnalyticsData& a, const btSolverAnalyticsData& b)
{
    EXPECT_EQ(a.m_numSolverCalls, b.m_numSolverCalls);
    EXPECT_EQ(a.m_numIterationsUsed, b.m_numIterationsUsed);
    EXPECT_EQ(a.m_islandId, b.m_islandId);
    EXPECT_EQ(a.m_numBodies, b.m_numBodies);
    EXPECT_EQ(a.m_numContactManifolds, b.m_numContactManifolds);
    EXPECT_EQ(a.m_remainingLeastSquaresResidual, b.m_remainingLeastSquaresResidual);
}
}  // namespace

TEST(SmallWorlds, CallNoSolverWhileAllBodiesSleep)
{
    for (const int cubes : {1, 5})
    {
        StockCubes stock(cubes);
        OwnCubes own(cubes);
        int atRest = 0;
        for (int step = 0; step < 2 * kUntilAsleep; ++step)
        {
            if (step == kUntilAsleep)
            {
                EXPECT_EQ(own.world.islandStats().serial, SerialIslands::AtRest);
                stock.push(1);
                own.push(1);
            }
            stock.step();
            own.step();
            ASSERT_TRUE(own.states() == stock.states()) << step;
            expectSameAnalytics(own.solver.m_analyticsData, stock.solver.m_analyticsData);
            atRest += own.world.islandStats().serial == SerialIslands::AtRest ? 1 : 0;
        }
        EXPECT_GT(atRest, kUntilAsleep / 2);
        EXPECT_LT(atRest, 2 * kUntilAsleep - 100);
    }
}

TEST(SmallWorlds, CallSolverForWhatMayChange)
{
    OwnCubes own(2);
    own.step(kUntilAsleep);
    ASSERT_EQ(own.world.islandStats().serial, SerialIslands::AtRest);
    const auto expectSolver = [&]
    {
        own.step();
        EXPECT_EQ(own.bodies[1]->getActivationState(), ISLAND_SLEEPING);
        EXPECT_NE(own.world.islandStats().serial, SerialIslands::AtRest);
    };
    btContactSolverInfo& info = own.world.getSolverInfo();
    info.m_numIterations = 0;
    expectSolver();
    info.m_numIterations = 10;
    info.m_leastSquaresResidualThreshold = -1;
    expectSolver();
    info.m_leastSquaresResidualThreshold = 0;
    {
        btPoint2PointConstraint joint(*own.bodies[1], vec(0, 0, 0));
        own.world.addConstraint(&joint);
        expectSolver();
        own.world.removeConstraint(&joint);
    }
    btRigidBody& body = *own.bodies[2];
    body.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    body.forceActivationState(ACTIVE_TAG);
    expectSolver();
}

TEST(SmallWorlds, VisitNoSleepingPair)
{
    FewCubes<World<btDiscreteDynamicsWorld>, Dispatcher> own(6);
    own.step(kUntilAsleep);
    auto& cache = static_cast<PairCache&>(*own.broadphase.getOverlappingPairCache());
    ASSERT_EQ(cache.getNumOverlappingPairs(), 6);
    const std::uint64_t visited = cache.stats().visited;
    const int manifolds = own.dispatcher.getNumManifolds();
    own.step(10);
    EXPECT_EQ(cache.stats().visited, visited);
    EXPECT_EQ(own.dispatcher.contactStats().pairs, 0u);
    EXPECT_EQ(own.dispatcher.getNumManifolds(), manifolds);
    own.push(3);
    own.step();
    EXPECT_GT(cache.stats().visited, visited);
    EXPECT_EQ(own.dispatcher.contactStats().pairs, 1u);
}

TEST(SmallWorlds, LeaveSweepsOfFastBodiesToBase)
{
    StockCubes stock(2);
    OwnCubes own(2);
    for (const auto* bodies : {&stock.bodies, &own.bodies})
    {
        (*bodies)[1]->setCcdMotionThreshold(btScalar(0.01));
        (*bodies)[1]->setCcdSweptSphereRadius(btScalar(0.2));
        (*bodies)[1]->setLinearVelocity(vec(40, 1, 0));
    }
    std::uint64_t swept = 0;
    for (int step = 0; step < 60; ++step)
    {
        stock.step();
        own.step();
        ASSERT_TRUE(own.states() == stock.states()) << step;
        swept += own.world.bodyStats().sweptBodies;
    }
    EXPECT_GT(swept, 0u);
}
}  // namespace cullet::test
