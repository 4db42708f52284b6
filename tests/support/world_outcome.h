// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <BulletDynamics/Dynamics/btDynamicsWorld.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>
#include <string>

/// Statistics of bodies in a world, to compare narrow phases.
namespace cullet::test
{
/// Calls visit(body) for each body that moves.
template <class Visit>
void forEachMovable(const btDynamicsWorld& world, const Visit& visit)
{
    for (int i = 0; i < world.getNumCollisionObjects(); ++i)
    {
        const btRigidBody* body = btRigidBody::upcast(world.getCollisionObjectArray()[i]);
        if (body != nullptr && !body->isStaticObject())
            visit(*body);
    }
}

/// Calls visit(depth) for each contact point; negative: a gap. Relative to the margins.
template <class Visit>
void forEachDepth(const btDynamicsWorld& world, const Visit& visit)
{
    const btDispatcher& dispatcher = *world.getDispatcher();
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
    {
        const btPersistentManifold* manifold =
            const_cast<btDispatcher&>(dispatcher).getManifoldByIndexInternal(i);
        for (int k = 0; k < manifold->getNumContacts(); ++k)
            visit(-double(manifold->getContactPoint(k).getDistance()));
    }
}

inline double kineticEnergy(const btDynamicsWorld& world)
{
    double energy = 0;
    forEachMovable(world,
                   [&](const btRigidBody& body)
                   {
                       if (!body.isActive())
                           return;
                       const btVector3 spin = body.getAngularVelocity() * body.getWorldTransform().getBasis();
                       const btVector3 inertia = body.getLocalInertia();
                       energy +=
                           0.5 / double(body.getInvMass()) * double(body.getLinearVelocity().length2()) +
                           0.5 * double((spin * spin).dot(inertia));
                   });
    return energy;
}

/// Kinetic and potential energy.
inline double totalEnergy(const btDynamicsWorld& world)
{
    double energy = kineticEnergy(world);
    forEachMovable(world,
                   [&](const btRigidBody& body)
                   {
                       energy -= double(world.getGravity().dot(body.getWorldTransform().getOrigin())) /
                                 double(body.getInvMass());
                   });
    return energy;
}

struct Outcome
{
    int sleepsAt = -1;      ///< step in which the last body fell asleep
    double deepest = 0;     ///< contact of all steps
    double meanDepth = 0;   ///< of the contacts that overlap, in the second half
    double lateEnergy = 0;  ///< largest kinetic energy in the second half
    double energyGain = 0;  ///< largest energy, kinetic and potential, above that of the start
    double meanHeight = 0;  ///< of all bodies that move, in the end
    double topHeight = 0;   ///< of one body
    double topShift = 0;    ///< its horizontal motion
};

inline std::ostream& operator<<(std::ostream& out, const Outcome& o)
{
    return out << "sleeps at " << o.sleepsAt << ", deepest " << o.deepest << ", mean depth " << o.meanDepth
               << ", late energy " << o.lateEnergy << ", energy gained " << o.energyGain << ", mean height "
               << o.meanHeight << ", top at " << o.topHeight << ", shifted by " << o.topShift;
}

/// Runs the steps of a world and measures after each.
///
/// @param top  the body whose position is recorded
/// @param step takes one step
template <class Step>
Outcome watch(const btDynamicsWorld& world, const btRigidBody& top, int steps, const Step& step)
{
    const btVector3 start = top.getWorldTransform().getOrigin();
    const double energy = totalEnergy(world);
    Outcome outcome;
    double depths = 0;
    int overlaps = 0;
    for (int i = 0; i < steps; ++i)
    {
        step();
        const bool isLate = i > steps / 2;
        forEachDepth(world,
                     [&](double depth)
                     {
                         outcome.deepest = std::max(outcome.deepest, depth);
                         depths += isLate ? std::max(depth, 0.0) : 0.0;
                         overlaps += isLate && depth > 0;
                     });
        outcome.energyGain = std::max(outcome.energyGain, totalEnergy(world) - energy);
        if (isLate)
            outcome.lateEnergy = std::max(outcome.lateEnergy, kineticEnergy(world));
        int awake = 0;
        forEachMovable(world, [&](const btRigidBody& body) { awake += body.isActive(); });
        if (outcome.sleepsAt < 0 && awake == 0)
            outcome.sleepsAt = i;
    }
    outcome.meanDepth = overlaps > 0 ? depths / overlaps : 0;
    int bodies = 0;
    forEachMovable(world,
                   [&](const btRigidBody& body)
                   {
                       outcome.meanHeight += double(body.getWorldTransform().getOrigin().y());
                       ++bodies;
                   });
    outcome.meanHeight /= std::max(bodies, 1);
    btVector3 moved = top.getWorldTransform().getOrigin() - start;
    outcome.topHeight = double(top.getWorldTransform().getOrigin().y());
    moved.setY(0);
    outcome.topShift = double(moved.length());
    return outcome;
}

/// How much worse than Bullet's an outcome may be, since any rounding changes a simulation.
struct Noise
{
    double depthFactor, depth;  ///< the deepest contact: factor of Bullet's depth, and metres added
    double restEnergy;          ///< kinetic energy of a world that counts as resting
    double height;              ///< difference of the mean final height of all bodies
};

/// Noise of bodies that stand from the start, which hardly changes.
constexpr Noise kStandingNoise = {1.25, 0.002, 1e-3, 0.004};

inline void expectNoWorse(const Outcome& ours, const Outcome& stock, const Noise& noise)
{
    EXPECT_LE(ours.deepest, noise.depthFactor * stock.deepest + noise.depth) << stock << '\n' << ours;
    EXPECT_LE(ours.lateEnergy, 2 * stock.lateEnergy + noise.restEnergy) << stock << '\n' << ours;
    EXPECT_LE(ours.energyGain, 1.5 * stock.energyGain + 0.01) << stock << '\n' << ours;
    EXPECT_NEAR(ours.meanHeight, stock.meanHeight, noise.height) << stock << '\n' << ours;
    if (stock.sleepsAt >= 0)
    {
        EXPECT_GE(ours.sleepsAt, 0) << stock << '\n' << ours;
        EXPECT_LE(ours.sleepsAt, stock.sleepsAt + 30) << stock << '\n' << ours;
    }
}

/// Compares both ways of using cullet with Bullet's narrow phase, and writes all three into the test's report
/// (--gtest_output=xml), by number where a test has several scenes.
inline void expectNoWorse(const Outcome& stock, const Outcome& registered, const Outcome& dispatcher,
                          const Noise& noise)
{
    const testing::TestResult& report = *testing::UnitTest::GetInstance()->current_test_info()->result();
    const std::string scene = std::to_string(report.test_property_count() / 3);
    testing::Test::RecordProperty("bullet." + scene, testing::PrintToString(stock));
    testing::Test::RecordProperty("registered." + scene, testing::PrintToString(registered));
    testing::Test::RecordProperty("cullet." + scene, testing::PrintToString(dispatcher));
    expectNoWorse(registered, stock, noise);
    expectNoWorse(dispatcher, stock, noise);
}
}  // namespace cullet::test
