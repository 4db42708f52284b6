// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/convex/convex_contacts.h"
#include "cullet/tests/plugin/log_scope.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace cullet::test
{
namespace
{
/// A dispatcher with its world, and two hulls, one of which falls onto the other.
struct OwnWorld
{
    OwnWorld()
    {
        world.emplace(dispatcher.get(), &broadphase, &solver, configuration.get());
        for (int i = 0; i < 2; ++i)
        {
            bodies[i] = std::make_unique<btRigidBody>(btScalar(i), nullptr, cube.get(), vec(1, 1, 1));
            bodies[i]->setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(0, 1.05 * i, 0)));
            world->addRigidBody(bodies[i].get());
        }
    }
    ~OwnWorld() { endWorld(); }
    OwnWorld(const OwnWorld&) = delete;
    OwnWorld& operator=(const OwnWorld&) = delete;

    void endWorld()
    {
        if (!world)
            return;
        for (const auto& body : bodies)
            world->removeRigidBody(body.get());
        world.reset();
    }

    std::unique_ptr<btDefaultCollisionConfiguration> configuration =
        std::make_unique<btDefaultCollisionConfiguration>();
    std::unique_ptr<btCollisionDispatcher> dispatcher =
        std::make_unique<btCollisionDispatcher>(configuration.get());
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    std::unique_ptr<btConvexHullShape> cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    std::unique_ptr<btRigidBody> bodies[2];
    std::optional<btDiscreteDynamicsWorld> world;
};

/// Whether the two tables of a dispatcher have an algorithm of cullet's for two boxes.
std::pair<bool, bool> hasBoxBox(btCollisionDispatcher& dispatcher, const IsaGjkRegistration& registration)
{
    btBoxShape box(vec(0.5, 0.5, 0.5));
    const auto isCounted = [&](ebtDispatcherQueryType table)
    {
        ConvexPairProbe probe(dispatcher, box, box, table);
        probe.place(vec(0, 3, 0), vec(0, 0, 0));
        const std::uint64_t before = registration.stats().separatedTotal;
        probe.step();
        return registration.stats().separatedTotal != before;
    };
    return {isCounted(BT_CONTACT_POINT_ALGORITHMS), isCounted(BT_CLOSEST_POINT_ALGORITHMS)};
}
}  // namespace

TEST(IsaGjkRegistration, OutlivesDispatcherAndWorldAndIsReusedWhenRepeated)
{
    OwnWorld own;
    const IsaGjkRegistration& first = registerIsaGjk(*own.dispatcher);
    for (int i = 0; i < 10; ++i)
        own.world->stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
    EXPECT_GT(first.stats().touchingTotal, 0u);
    // A second registration while pairs exist: counters are reset, and the pairs' algorithms keep using the same
    // object.
    EXPECT_EQ(&registerIsaGjk(*own.dispatcher), &first);
    EXPECT_EQ(first.stats().touchingTotal, 0u);
    own.bodies[1]->activate(true);
    own.world->stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
    EXPECT_EQ(first.stats().touchingTotal, 1u);
    own.endWorld();
    EXPECT_EQ(own.dispatcher->getNumManifolds(), 0);
    own.dispatcher.reset();
    own.configuration.reset();
    EXPECT_EQ(first.stats().touchingTotal, 1u);
}

TEST(IsaGjkRegistration, GivesBoxesBackWhenItIsRegisteredAgainWithoutThem)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    const auto none = std::make_pair(false, false), both = std::make_pair(true, true);
    // Queries for the closest points stay with Bullet.
    const auto contactsOnly = std::make_pair(true, false);
    const auto after = [&](BoxPairs boxPairs)
    {
        IsaGjkOptions options;
        options.boxPairs = boxPairs;
        return hasBoxBox(dispatcher, registerIsaGjk(dispatcher, options));
    };
    EXPECT_EQ(hasBoxBox(dispatcher, registerIsaGjk(dispatcher)), contactsOnly);
    EXPECT_EQ(after(BoxPairs::IsaGjk), both);
    EXPECT_EQ(after(BoxPairs::SeparatingAxes), contactsOnly);
    EXPECT_EQ(after(BoxPairs::Bullet), none);
    EXPECT_EQ(after(BoxPairs::IsaGjk), both);
    EXPECT_EQ(after(BoxPairs::Bullet), none);
    EXPECT_EQ(after(BoxPairs::SeparatingAxes), contactsOnly);
}

TEST(IsaGjkRegistration, LimitsContactsOfPairToPatchPoints)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    for (int most = 1; most <= 4; ++most)
    {
        IsaGjkOptions options;
        options.patchPoints = most;
        ConvexBench bench(false, options);
        ConvexPairProbe probe(bench.dispatcher, *cube, *cube);
        probe.place(vec(0, 1.08, 0.1), vec(0, 0, 0));
        EXPECT_EQ(probe.step()->getNumContacts(), most);
        EXPECT_EQ(probe.query().size(), static_cast<std::size_t>(most));
    }
}

TEST(IsaGjkRegistration, WarnsOfPatchPointsOutOfRangeAndTakesTheNearest)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    const LogScope scope;
    IsaGjkOptions options;
    for (const auto& [given, used] : {std::pair(0, 1), std::pair(-7, 1), std::pair(5, 4)})
    {
        options.patchPoints = given;
        loggedLines().clear();
        EXPECT_EQ(registerIsaGjk(dispatcher, options).options().patchPoints, used);
        ASSERT_EQ(loggedLines().size(), 1u);
        EXPECT_NE(loggedLines()[0].find(std::to_string(given) + " points"), std::string::npos);
    }
    loggedLines().clear();
    options.patchPoints = 2;
    EXPECT_EQ(registerIsaGjk(dispatcher, options).options().patchPoints, 2);
    EXPECT_TRUE(loggedLines().empty());
}
}  // namespace cullet::test
