// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/support/world_outcome.h"

#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

namespace cullet::test
{
namespace
{
template <class Build>
Outcome run(Narrow narrow, int steps, const Build& build)
{
    ConvexWorld world(narrow);
    build(world);
    return watch(world.world, *world.bodies.back(), steps, [&] { world.step(); });
}

/// Steps a world once with each narrow phase.
///
/// @param ours [out] of cullet::Dispatcher
template <class Build>
void compare(int steps, const Build& build, Outcome& stock, Outcome& ours,
             const Noise& noise = kStandingNoise)
{
    stock = run(Narrow::Stock, steps, build);
    const Outcome registered = run(Narrow::IsaGjk, steps, build);
    ours = run(Narrow::Dispatcher, steps, build);
    expectNoWorse(stock, registered, ours, noise);
}

constexpr double kStandingHalf = 0.54;  ///< of a cube hull, margin included

btBoxShape& groundShape()
{
    static btBoxShape shape(vec(40, 1, 40));
    return shape;
}

void addGround(ConvexWorld& world)
{
    world.add(&groundShape(), 0, vec(0, -1, 0));
}
}  // namespace

TEST(IsaGjkWorlds, GiveHullBoxFourContactsInFirstTouchingStep)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    ConvexWorld world(Narrow::IsaGjk);
    addGround(world);
    btRigidBody& body = world.add(cube.get(), 1, vec(0, 0.7, 0));
    int steps = 0;
    while (world.contactsOf(*world.bodies[0], body) == 0 && steps < 100)
    {
        world.step();
        ++steps;
    }
    EXPECT_EQ(world.contactsOf(*world.bodies[0], body), 4) << steps;
    world.step(120);
    EXPECT_EQ(world.contactsOf(*world.bodies[0], body), 4);
    EXPECT_NEAR(double(body.getWorldTransform().getOrigin().y()), kStandingHalf, 2e-3);
}

TEST(IsaGjkWorlds, KeepStackOfTenHullsStandingForAMinuteAndLetItSleep)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    const auto build = [&](ConvexWorld& world)
    {
        addGround(world);
        for (int i = 0; i < 10; ++i)
            world.add(cube.get(), 1, vec(0, kStandingHalf * (1 + 2 * i), 0));
    };
    Outcome stock, ours;
    compare(3600, build, stock, ours);
    EXPECT_GT(ours.sleepsAt, 0);
    EXPECT_NEAR(ours.topHeight, 19 * kStandingHalf, 0.05) << stock << '\n' << ours;
    EXPECT_LT(ours.topShift, 0.1) << stock << '\n' << ours;
}

TEST(IsaGjkWorlds, KeepStackOfFiveHullsStandingWithoutSleeping)
{
    // A tower of ten would topple in any case, as with ten of Bullet's own boxes and ten solver iterations.
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    // Nearly congruent faces have many possible common corners: no start may make the stack sway.
    for (const double lean : {0.0, 1e-7, 3e-5, 1e-3})
    {
        Outcome stock, ours;
        const auto build = [&](ConvexWorld& world)
        {
            addGround(world);
            for (int i = 0; i < 5; ++i)
                world.add(cube.get(), 1, vec(lean * i, kStandingHalf * (1 + 2 * i), 0))
                    .setActivationState(DISABLE_DEACTIVATION);
        };
        compare(1200, build, stock, ours);
        EXPECT_NEAR(ours.topHeight, 9 * kStandingHalf, 0.02) << stock << '\n' << ours;
        EXPECT_LT(ours.topShift, 0.05) << stock << '\n' << ours;
        EXPECT_LT(ours.lateEnergy, 1e-4) << stock << '\n' << ours;
    }
}

TEST(IsaGjkWorlds, KeepWallOfFiveHundredHullBricksStanding)
{
    constexpr int kRows = 10;
    constexpr int kColumns = 50;
    const double left = -1.085 * kColumns / 2;
    const auto brick = makeHullShape(boxPoints(0.5, 0.25, 0.25));
    const auto half = makeHullShape(boxPoints(0.23, 0.25, 0.25));
    Outcome stock, ours;
    const auto build = [&](ConvexWorld& world)
    {
        addGround(world);
        for (int row = 0; row < kRows; ++row)
        {
            const double y = 0.29 * (1 + 2 * row);
            for (int i = 0; i < kColumns; ++i)
                world.add(brick.get(), 1, vec(left + 1.085 * (i + 0.5 * (row % 2)), y, 0));
            if (row % 2 == 1)
            {
                world.add(half.get(), 0.5, vec(left - 0.27, y, 0));
                continue;
            }
            world.add(half.get(), 0.5, vec(left + 1.085 * (kColumns - 0.5) + 0.27, y, 0));
        }
    };
    compare(240, build, stock, ours);
    EXPECT_NEAR(ours.topHeight, 0.29 * (2 * kRows - 1), 0.1) << stock << '\n' << ours;
    EXPECT_LT(ours.topShift, 0.1) << stock << '\n' << ours;
}

TEST(IsaGjkWorlds, KeepPyramidStandingAndLetItSleep)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    Outcome stock, ours;
    const auto build = [&](ConvexWorld& world)
    {
        addGround(world);
        for (int row = 0; row < 8; ++row)
        {
            for (int i = 0; i < 8 - row; ++i)
                world.add(cube.get(), 1, vec(1.1 * (i + 0.5 * row), kStandingHalf * (1 + 2 * row), 0));
        }
    };
    compare(300, build, stock, ours);
    EXPECT_GT(ours.sleepsAt, 0) << stock << '\n' << ours;
    EXPECT_NEAR(ours.topHeight, kStandingHalf * 15, 0.02) << stock << '\n' << ours;
    EXPECT_LT(ours.topShift, 0.02) << stock << '\n' << ours;
}

TEST(IsaGjkWorlds, KeepHouseOfSevenCardsStandingAsWithBullet)
{
    const auto card = makeHullShape(boxPoints(0.5, 0.02, 0.4));
    const auto roof = makeHullShape(boxPoints(0.8, 0.02, 0.4));
    card->setMargin(btScalar(0.01));
    roof->setMargin(btScalar(0.01));
    Outcome stock, ours;
    const auto build = [&](ConvexWorld& world)
    {
        addGround(world);
        // Two cards that lean on each other.
        const auto addTent = [&](double x, double y)
        {
            for (const double side : {-1.0, 1.0})
                world.add(card.get(), 1,
                          btTransform(btQuaternion(btVector3(0, 0, 1), btScalar(-side * 1.25)),
                                      vec(x + side * 0.19, y + 0.495, 0)));
        };
        addTent(-0.4, 0);
        addTent(0.4, 0);
        world.add(roof.get(), 1, vec(0, 1.02, 0));
        addTent(0, 1.05);
        for (const auto& body : world.bodies)
            body->setFriction(1);
    };
    // The cards shift until they are stable.
    compare(240, build, stock, ours, {1.25, 0.002, 1e-3, 0.01});
    EXPECT_EQ(ours.topHeight > 1.4, stock.topHeight > 1.4) << stock << '\n' << ours;
    EXPECT_GT(ours.topHeight, 1.4) << stock << '\n' << ours;
}

TEST(IsaGjkWorlds, LetDodecahedronRollAndComeToRest)
{
    std::vector<btVector3> points = boxPoints(0.3, 0.3, 0.3);
    const double g = (1 + std::sqrt(5.0)) / 2;
    for (const double a : {-0.3, 0.3})
    {
        for (const double b : {-0.3, 0.3})
        {
            points.push_back(vec(0, a / g, b * g));
            points.push_back(vec(a / g, b * g, 0));
            points.push_back(vec(b * g, 0, a / g));
        }
    }
    const auto dodecahedron = makeHullShape(points);
    Outcome stock, ours;
    const auto build = [&](ConvexWorld& world)
    {
        addGround(world);
        btRigidBody& body = world.add(dodecahedron.get(), 1, vec(0, 0.8, 0));
        body.setLinearVelocity(vec(3, 0, 0.5));
        body.setAngularVelocity(vec(0.3, 0, -6));
    };
    compare(600, build, stock, ours);
    EXPECT_GT(ours.topShift, 0.5) << stock << '\n' << ours;
    EXPECT_GT(ours.sleepsAt, 0) << stock << '\n' << ours;
    // On one of its faces.
    EXPECT_NEAR(ours.topHeight, stock.topHeight, 1e-3) << stock << '\n' << ours;
}

TEST(IsaGjkWorlds, BringHullsAndCompoundsToRestOnMeshesAndCompounds)
{
    btTriangleMesh mesh;
    for (int i = 0; i < 64; ++i)
    {
        const double x = i % 8 - 4.0, z = i / 8 - 4.0;
        mesh.addTriangle(vec(x, 0, z), vec(x, 0, z + 1), vec(x + 1, 0, z));
        mesh.addTriangle(vec(x + 1, 0, z), vec(x, 0, z + 1), vec(x + 1, 0, z + 1));
    }
    btBvhTriangleMeshShape meshShape(&mesh, true);
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    const auto slab = makeHullShape(boxPoints(4, 0.5, 4));
    btCompoundShape floor, pair, nested;
    floor.addChildShape(btTransform(btQuaternion::getIdentity(), vec(0, -0.54, 0)), slab.get());
    pair.addChildShape(btTransform(btQuaternion::getIdentity(), vec(-0.6, 0, 0)), cube.get());
    pair.addChildShape(btTransform(btQuaternion::getIdentity(), vec(0.6, 0, 0)), cube.get());
    nested.addChildShape(btTransform(btQuaternion(btVector3(0, 1, 0), btScalar(0.5)), vec(0, 0.1, 0)), &pair);
    for (btCollisionShape* ground :
         {static_cast<btCollisionShape*>(&meshShape), static_cast<btCollisionShape*>(&floor)})
    {
        for (btCollisionShape* shape :
             {static_cast<btCollisionShape*>(cube.get()), static_cast<btCollisionShape*>(&pair),
              static_cast<btCollisionShape*>(&nested)})
        {
            for (const bool isGroundLast : {false, true})
            {
                const auto build = [&](ConvexWorld& world)
                {
                    if (!isGroundLast)
                        world.add(ground, 0, vec(0, 0, 0));
                    btRigidBody& body = world.add(shape, 1, vec(0.2, 0.8, 0.1));
                    if (isGroundLast)
                        world.add(ground, 0, vec(0, 0, 0));
                    std::swap(world.bodies.front(),
                              isGroundLast ? world.bodies.back() : world.bodies.front());
                    EXPECT_EQ(world.bodies.back().get(), &body);
                };
                Outcome stock, ours;
                compare(200, build, stock, ours, {1.5, 0.01, 5e-3, 0.004});
                EXPECT_NEAR(ours.topHeight, stock.topHeight, 2e-3) << stock << '\n' << ours;
                EXPECT_LT(ours.topShift, 0.03) << stock << '\n' << ours;
                EXPECT_GT(ours.sleepsAt, 0) << stock << '\n' << ours;
            }
        }
    }
}

namespace
{
std::string events;  ///< of the contact callbacks, one letter each, repeated ones once

void note(char event)
{
    if (events.empty() || events.back() != event)
        events.push_back(event);
}

struct Callbacks
{
    Callbacks()
    {
        events.clear();
        gContactStartedCallback = [](btPersistentManifold* const&) { note('S'); };
        gContactEndedCallback = [](btPersistentManifold* const&) { note('E'); };
        gContactDestroyedCallback = [](void*)
        {
            note('D');
            return true;
        };
        gContactProcessedCallback = [](btManifoldPoint& point, void*, void*)
        {
            // Non-null user data makes Bullet report the removal of the point.
            point.m_userPersistentData = &events;
            note('P');
            return true;
        };
        gContactAddedCallback = [](btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                                   const btCollisionObjectWrapper*, int, int)
        {
            note('A');
            return true;
        };
    }
    ~Callbacks()
    {
        gContactStartedCallback = nullptr;
        gContactEndedCallback = nullptr;
        gContactDestroyedCallback = nullptr;
        gContactProcessedCallback = nullptr;
        gContactAddedCallback = nullptr;
    }
};

/// Events of a body that falls on the ground, is thrown up halfway if it does not bounce, and is removed.
std::string eventsOf(Narrow narrow, btCollisionShape& shape, double restitution, int steps)
{
    const Callbacks callbacks;
    {
        ConvexWorld world(narrow);
        addGround(world);
        btRigidBody& body = world.add(&shape, 1, vec(0, 1.2, 0));
        for (auto& each : world.bodies)
        {
            each->setRestitution(btScalar(restitution));
            each->setCollisionFlags(each->getCollisionFlags() |
                                    btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
        }
        world.step(steps / 2);
        if (restitution == 0)
        {
            body.activate();
            body.setLinearVelocity(vec(0, 2, 0));
        }
        world.step(steps / 2);
        world.world.removeRigidBody(&body);
        world.world.addRigidBody(&body);
    }
    return events;
}

/// The events that do not depend on the number of points.
std::string startsAndEnds(const std::string& all)
{
    std::string kept;
    for (const char event : all)
    {
        if (event == 'S' || event == 'E')
            kept.push_back(event);
    }
    return kept;
}
}  // namespace

TEST(IsaGjkWorlds, CallContactCallbacksInBulletsOrderForRestingOrBouncingBody)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    for (const double restitution : {0.0, 1.0})
    {
        const int steps = restitution > 0 ? 300 : 180;
        const std::string stock = eventsOf(Narrow::Stock, *cube, restitution, steps);
        const std::string ours = eventsOf(Narrow::IsaGjk, *cube, restitution, steps);
        const std::string dispatcher = eventsOf(Narrow::Dispatcher, *cube, restitution, steps);
        EXPECT_EQ(ours, dispatcher);
        // The number of later bounces depends on rounding.
        EXPECT_EQ(startsAndEnds(ours).substr(0, 4), startsAndEnds(stock).substr(0, 4))
            << stock << ' ' << ours;
        // A patch starts like a single point, with more points.
        EXPECT_EQ(ours.substr(0, 2), stock.substr(0, 2)) << stock << ' ' << ours;
        EXPECT_LT(ours.find('S'), ours.find('P')) << ours;
        for (const char event : std::string("SADPE"))
            EXPECT_EQ(ours.find(event) == std::string::npos, stock.find(event) == std::string::npos)
                << event << ' ' << stock << ' ' << ours;
        if (restitution > 0)
        {
            EXPECT_GT(startsAndEnds(ours).size(), 3u) << ours;
        }
    }
}

TEST(IsaGjkWorlds, StartAndEndContactsOfBodyAndChildrenAsOftenAsBullet)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    btCompoundShape one, two;
    one.addChildShape(btTransform(btQuaternion::getIdentity(), vec(0.1, 0, 0)), cube.get());
    two.addChildShape(btTransform(btQuaternion::getIdentity(), vec(-0.6, 0, 0)), cube.get());
    two.addChildShape(btTransform(btQuaternion::getIdentity(), vec(0.6, 0, 0)), cube.get());
    const std::pair<btCollisionShape*, const char*> shapes[] = {
        {cube.get(), "SESE"}, {&one, "SESE"}, {&two, "SSEESSEE"}};
    for (const auto& [shape, expected] : shapes)
    {
        for (const Narrow narrow : {Narrow::Stock, Narrow::IsaGjk, Narrow::Dispatcher})
            EXPECT_EQ(startsAndEnds(eventsOf(narrow, *shape, 0, 200)), expected)
                << shape->getName() << ' ' << int(narrow);
    }
}

TEST(IsaGjkDispatcher, CallsNearCallbackOfApplicationForEveryPair)
{
    static int calls = 0;
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    ConvexWorld world(Narrow::Dispatcher);
    world.addIdleRow(cube.get());
    world.step(3);
    auto& dispatcher = static_cast<Dispatcher&>(world.dispatcher());
    EXPECT_EQ(dispatcher.idlePairs(), 4u);
    dispatcher.setNearCallback(
        [](btBroadphasePair& pair, btCollisionDispatcher& each, const btDispatcherInfo& info)
        {
            ++calls;
            btCollisionDispatcher::defaultNearCallback(pair, each, info);
        });
    calls = 0;
    world.step();
    EXPECT_EQ(calls, 4);
    EXPECT_EQ(dispatcher.idlePairs(), 0u);
}

TEST(IsaGjkDispatcher, AllowsCallbacksToRemoveBodiesDuringDispatch)
{
    static ConvexWorld* current = nullptr;
    static btRigidBody* victim = nullptr;
    const auto ball = makeHullShape(ballPoints(20, 0.5, 6));
    ConvexWorld world(Narrow::Dispatcher);
    addGround(world);
    for (int i = 0; i < 27; ++i)
        world.add(ball.get(), 1, vec(1.02 * (i % 3), 0.6 + 1.02 * (i / 9), 1.02 * (i / 3 % 3)));
    current = &world;
    world.step(5);
    int removed = 0;
    for (int i = 0; i < 20; ++i)
    {
        victim = world.bodies.back().get();
        gContactStartedCallback = nullptr;
        gContactProcessedCallback = [](btManifoldPoint&, void* a, void* b)
        {
            if (victim != nullptr && a != victim && b != victim)
            {
                current->world.removeRigidBody(victim);
                victim = nullptr;
            }
            return true;
        };
        world.step();
        gContactProcessedCallback = nullptr;
        if (victim == nullptr)
        {
            world.bodies.pop_back();
            ++removed;
        }
    }
    EXPECT_GT(removed, 5);
    for (const auto& body : world.bodies)
        EXPECT_GT(double(body->getWorldTransform().getOrigin().y()), -1.5);
}
}  // namespace cullet::test
