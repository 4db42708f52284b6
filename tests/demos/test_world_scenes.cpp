// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/drop/pair_audit.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/scenes/box_scene.h"
#include "cullet/tests/demos/scene_support.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <set>
#include <stdexcept>

namespace cullet
{
namespace
{
/// Saves a scene's world as Bullet does.
void save(WorldScene& scene, const std::string& path)
{
    btDefaultSerializer serializer;
    scene.world().serialize(&serializer);
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(serializer.getBufferPointer()),
               serializer.getCurrentBufferSize());
}

std::string temporaryFile(const std::string& name)
{
    return testing::TempDir() + "cullet_scenes_" + std::to_string(sizeof(btScalar)) + name;
}

TEST(WorldScenes, StepToSameBitsWithGridBruteForceAndSap)
{
    for (const WorldSceneInfo& info : worldScenes())
    {
        SCOPED_TRACE(info.name);
        if (info.name == std::string("file"))
            continue;
        WorldSceneOptions options = makeOptions(60);
        const auto grid = makeWorldScene(info.name, options);
        options.backend = "brute";
        const auto brute = makeWorldScene(info.name, options);
        options.backend = "sap";
        const auto sap = makeWorldScene(info.name, options);
        EXPECT_EQ(grid->name(), info.name);
        const std::uint64_t start = grid->stateHash();
        std::uint64_t pairs = 0;
        // Bodies of this scene fall for a second before they meet anything.
        const int steps = info.name == std::string("convex-mesh") ? 80 : 40;
        for (int step = 0; step < steps; ++step)
        {
            grid->step();
            brute->step();
            sap->step();
            ASSERT_EQ(grid->stateHash(), brute->stateHash()) << step;
            pairs += grid->pairCount();
        }
        EXPECT_EQ(grid->stateHash(), sap->stateHash());
        EXPECT_NE(grid->stateHash(), start) << "nothing moves";
        EXPECT_GT(pairs, 20u) << "nothing meets";
        EXPECT_EQ(digestCache(grid->world()), digestExact(collectProxies(grid->world())));
        for (const AuditedProxy& proxy : collectProxies(grid->world()))
        {
            for (int axis = 0; axis < 3; ++axis)
            {
                // A plane has no bounds.
                EXPECT_TRUE(std::fabs(proxy.box.min[axis]) < info.halfExtent || proxy.box.min[axis] < -1e17);
                EXPECT_TRUE(std::fabs(proxy.box.max[axis]) < info.halfExtent || proxy.box.max[axis] > 1e17);
            }
        }
    }
}

TEST(WorldScenes, DependOnTheirSeed)
{
    // The other scenes draw nothing at random.
    for (const std::string name :
         {"drop",     "boxes", "hulls",     "hills",  "thesis",  "W1",         "W2",
          "W3",       "W4",    "W5",        "pour",   "pile",    "static",     "planet",
          "stampede", "crowd", "compounds", "robots", "terrain", "free-hulls", "ragdolls",
          "statics",  "city",  "needles",   "slide"})
    {
        WorldSceneOptions options = makeOptions(50);
        const auto one = makeWorldScene(name, options);
        options.seed = 2;
        const auto two = makeWorldScene(name, options);
        stepMany(*one, 5);
        stepMany(*two, 5);
        EXPECT_NE(one->stateHash(), two->stateHash()) << name;
    }
}

TEST(WorldScenes, HaveTheBodiesThatWereAskedFor)
{
    for (const std::string name :
         {"drop",       "boxes",       "barrels", "hills",    "thesis", "W2",      "pile",      "wall",
          "domino",     "cards",       "planet",  "stampede", "soft",   "crowd",   "compounds", "terrain",
          "free-hulls", "convex-mesh", "pyramid", "statics",  "city",   "needles", "slide"})
        EXPECT_EQ(countObjects(*make(name, 101), moves), 101) << name;
}

TEST(WorldScenes, AnswerAnUnknownNameWithTheKnownOnes)
{
    try
    {
        make("lottery", 5);
        FAIL() << "no exception";
    }
    catch (const std::invalid_argument& error)
    {
        for (const WorldSceneInfo& info : worldScenes())
            EXPECT_NE(std::string(error.what()).find(info.name), std::string::npos);
    }
}

TEST(WorldScenes, MoveThesisSpheresOf80TrianglesLikeBoxesOfW1)
{
    const auto thesis = make("thesis", 2000);
    const auto& hull = static_cast<const btConvexHullShape&>(*object(*thesis, 0).getCollisionShape());
    // Euler: 80 triangles have 120 edges and 42 corners.
    EXPECT_EQ(hull.getNumPoints(), 42);
    for (int i = 0; i < hull.getNumPoints(); ++i)
        EXPECT_NEAR(hull.getScaledPoint(i).length() + hull.getMargin(), 1, 1e-5);
    const auto boxes = findBoxScene("W1")->make({2000, false, 1});
    for (int frame = 0; frame < 3; ++frame)
    {
        thesis->step();
        boxes->step();
    }
    for (int i = 0; i < 2000; ++i)
    {
        const Aabb& box = boxes->boxes()[static_cast<std::size_t>(i)];
        ASSERT_NEAR(origin(*thesis, i).x(), (box.min[0] + box.max[0]) / 2, 1e-4) << i;
    }
    // About one pair per body.
    EXPECT_GT(thesis->pairCount(), 1600u);
    EXPECT_LT(thesis->pairCount(), 2800u);
    EXPECT_GT(thesis->contactPairCount(), thesis->pairCount() / 4);
}

TEST(WorldScenes, PourBodiesAndReuseOldestWhenFull)
{
    const auto pour = make("pour", 40);
    EXPECT_EQ(countObjects(*pour, moves), 0);
    stepMany(*pour, 10);
    EXPECT_EQ(countObjects(*pour, moves), 4);
    EXPECT_NEAR(origin(*pour, 5).y(), 10 - 5 / 6.0 - 5 / 36.0, 0.05) << "ten steps of free fall";
    stepMany(*pour, 90);
    EXPECT_EQ(countObjects(*pour, moves), 40);
    const btCollisionObject* first = &object(*pour, 5);
    EXPECT_LT(first->getWorldTransform().getOrigin().y(), 3);
    stepMany(*pour, 1);
    EXPECT_EQ(countObjects(*pour, moves), 40);
    EXPECT_GT(first->getWorldTransform().getOrigin().y(), btScalar(9.8)) << "is poured anew";
    stepMany(*pour, 150);
    EXPECT_EQ(countObjects(*pour, moves), 40);
    EXPECT_GT(pour->lowestHeight(), btScalar(0.2));
    EXPECT_GT(pour->contactPairCount(), 15u);
}

TEST(WorldScenes, BuildPileAsConeThatStays)
{
    const auto pile = make("pile", 600);
    double highest = 0;
    double farthest = 0;
    for (int i = 1; i <= 600; ++i)
    {
        const btVector3 place = origin(*pile, i);
        highest = std::max(highest, double(place.y()));
        farthest = std::max(farthest, std::hypot(double(place.x()), double(place.z())));
    }
    EXPECT_NEAR(highest / farthest, 0.6, 0.2);
    stepMany(*pile, 30);
    // Except at the rims, each body rests on one and carries one.
    EXPECT_GT(pile->contactPairCount(), 450u);
    EXPECT_GT(pile->lowestHeight(), btScalar(0.4));
}

TEST(WorldScenes, KeepWallStandingUntilBallHits)
{
    const auto wall = make("wall", 201);
    stepMany(*wall, 10);
    // 20 bricks in each of ten rows; 25 mm of settling at most.
    std::set<long> rows;
    for (int i = 1; i <= 200; ++i)
    {
        EXPECT_LT(btFabs(origin(*wall, i).z()), btScalar(0.05)) << i;
        rows.insert(std::lround((origin(*wall, i).y() - 0.25) * 2));
    }
    EXPECT_EQ(rows.size(), 10u);
    stepMany(*wall, 50);
    int pushed = 0;
    for (int i = 1; i <= 200; ++i)
        pushed += origin(*wall, i).z() > 1 ? 1 : 0;
    EXPECT_GT(pushed, 5);
}

TEST(WorldScenes, ToppleDominoesOneAfterAnother)
{
    const auto domino = make("domino", 40);
    const auto isDown = [&](int piece) { return origin(*domino, piece + 1).y() < btScalar(0.4); };
    for (int piece = 1; piece < 40; ++piece)
        EXPECT_NEAR((origin(*domino, piece + 1) - origin(*domino, piece)).length(), 0.4, 0.05) << piece;
    stepMany(*domino, 60);
    EXPECT_TRUE(isDown(0));
    EXPECT_FALSE(isDown(39)) << "not all at once";
    stepMany(*domino, 600);
    EXPECT_TRUE(isDown(20));
    EXPECT_TRUE(isDown(38));
}

TEST(WorldScenes, BuildCardsInFourStoreysOfLeaningPairs)
{
    const auto cards = make("cards", 26);
    int leaning = 0;
    int lying = 0;
    double highest = 0;
    for (int i = 1; i <= 26; ++i)
    {
        const double up = btFabs(object(*cards, i).getWorldTransform().getBasis().getColumn(1).y());
        leaning += std::fabs(up - std::cos(20 * 3.14159265 / 180)) < 1e-4 ? 1 : 0;
        lying += up < 1e-4 ? 1 : 0;
        highest = std::max(highest, double(origin(*cards, i).y()));
    }
    EXPECT_EQ(leaning, 20);
    EXPECT_EQ(lying, 6);
    EXPECT_NEAR(highest, 3.5 * 0.99, 0.05);
    stepMany(*cards, 5);
    double fastest = 0;
    for (int i = 1; i <= 26; ++i)
        fastest = std::max(fastest, double(object(*cards, i).getInterpolationLinearVelocity().length()));
    EXPECT_LT(fastest, 2.0) << "nothing is pressed apart";
}

TEST(WorldScenes, MoveOnlyHundredBodiesOfStaticScene)
{
    const auto scene = make("static", 3000);
    EXPECT_EQ(countObjects(*scene, moves), 100);
    EXPECT_EQ(scene->world().getNumCollisionObjects(), 3000);
    std::vector<btVector3> before;
    for (int i = 0; i < 3000; ++i)
        before.push_back(origin(*scene, i));
    EXPECT_FALSE(scene->world().getForceUpdateAllAabbs());
    stepMany(*scene, 1);
    for (int i = 0; i < 3000; ++i)
    {
        const double moved = (origin(*scene, i) - before[static_cast<std::size_t>(i)]).length();
        if (i < 100)
        {
            EXPECT_TRUE(moved > 0.99 * 3 / 60 && moved < 1.01 * 6 / 60) << i << ": " << moved;
        }
        else
        {
            EXPECT_EQ(moved, 0) << i;
        }
    }
    // One pair per body, of which one in thirty moves; static bodies do not pair with each other.
    EXPECT_GT(scene->pairCount(), 40u);
    EXPECT_LT(scene->pairCount(), 400u);
}

TEST(WorldScenes, SpreadPlanetBoxesOverSixDecadesOfSizes)
{
    const auto planet = make("planet", 3000);
    int decades[6] = {};
    for (int i = 1; i <= 3000; ++i)
    {
        btVector3 low;
        btVector3 high;
        object(*planet, i).getCollisionShape()->getAabb(btTransform::getIdentity(), low, high);
        const double decade = std::log10(double(high.x() - low.x())) + 1;
        ASSERT_TRUE(decade > -1e-3 && decade < 6 + 1e-3) << decade;
        ++decades[std::clamp(static_cast<int>(decade), 0, 5)];
        EXPECT_GT(origin(*planet, i).length(), 1.49e5);
    }
    for (const int count : decades)
        EXPECT_NEAR(count, 500, 80);
    const btVector3 before = origin(*planet, 7);
    stepMany(*planet, 100);
    EXPECT_NEAR(origin(*planet, 7).length() / before.length(), 1, 1e-4) << "round and round";
    const double perBody = double(planet->pairCount()) / 3000;
    EXPECT_GT(perBody, 0.2);
    EXPECT_LT(perBody, 20);
}

TEST(WorldScenes, HangWheelsUnderVehiclesBeforeFirstStep)
{
    const auto stampede = make("stampede", 40);
    ASSERT_EQ(stampede->vehicles().size(), 20u);
    for (const btRaycastVehicle* vehicle : stampede->vehicles())
    {
        ASSERT_EQ(vehicle->getNumWheels(), 4);
        for (int i = 0; i < 4; ++i)
        {
            const btWheelInfo& wheel = vehicle->getWheelInfo(i);
            const btVector3 hung =
                wheel.m_worldTransform.getOrigin() -
                vehicle->getRigidBody()->getWorldTransform() * wheel.m_chassisConnectionPointCS;
            EXPECT_NEAR(double(hung.y()), -double(wheel.getSuspensionRestLength()), 1e-4);
            EXPECT_NEAR(double(hung.x()), 0, 1e-4);
            EXPECT_NEAR(double(hung.z()), 0, 1e-4);
        }
    }
}

TEST(WorldScenes, DriveStampedeForwardWithGhostsThatSeeVehicles)
{
    const auto stampede = make("stampede", 40);
    int ghosts = 0;
    std::vector<btVector3> before;
    for (int i = 0; i < stampede->world().getNumCollisionObjects(); ++i)
    {
        before.push_back(origin(*stampede, i));
        ghosts += btGhostObject::upcast(&object(*stampede, i)) != nullptr ? 1 : 0;
    }
    EXPECT_EQ(ghosts, 20);
    stepMany(*stampede, 120);
    int seen = 0;
    for (int i = 0; i < stampede->world().getNumCollisionObjects(); ++i)
    {
        const btVector3 way = origin(*stampede, i) - before[static_cast<std::size_t>(i)];
        if (moves(object(*stampede, i)))
        {
            EXPECT_GT(way.z(), btScalar(1)) << i;
        }
        if (const auto* ghost = btGhostObject::upcast(&object(*stampede, i)))
            seen += ghost->getNumOverlappingObjects();
    }
    EXPECT_GT(seen, 20) << "each at least its own vehicle";
    EXPECT_GT(stampede->lowestHeight(), btScalar(0.4)) << "on wheels";
}

TEST(WorldScenes, KeepSoftBallsAboveFloorWithExactPairs)
{
    const auto soft = make("soft", 16);
    EXPECT_EQ(countObjects(*soft, [](const btCollisionObject& one)
                           { return one.getInternalType() == btCollisionObject::CO_SOFT_BODY; }),
              8);
    stepMany(*soft, 90);
    EXPECT_EQ(digestCache(soft->world()), digestExact(collectProxies(soft->world())));
    for (const AuditedProxy& proxy : collectProxies(soft->world()))
        EXPECT_GT(proxy.box.max[1], -0.1);
}

TEST(WorldScenes, LetCrowdWalkOnFloorAndMeet)
{
    const auto crowd = make("crowd", 64);
    std::vector<btVector3> before;
    for (int i = 1; i <= 64; ++i)
        before.push_back(origin(*crowd, i));
    stepMany(*crowd, 60);
    double walked = 0;
    int met = 0;
    for (int i = 1; i <= 64; ++i)
    {
        const double way = (origin(*crowd, i) - before[static_cast<std::size_t>(i - 1)]).length();
        EXPECT_LT(way, 3.2) << "3 m/s for a second";
        walked += way;
        EXPECT_NEAR(origin(*crowd, i).y(), 0.85, 0.3) << i;
        met += btGhostObject::upcast(&object(*crowd, i))->getNumOverlappingObjects() > 1 ? 1 : 0;
    }
    EXPECT_GT(walked / 64, 0.8);
    EXPECT_GT(met, 10);
}

TEST(WorldScenes, LoadBodiesThatWereSavedToFile)
{
    const auto saved = make("boxes", 30);
    stepMany(*saved, 20);
    const std::string path = temporaryFile("saved.bullet");
    save(*saved, path);
    WorldSceneOptions options = makeOptions(0);
    options.file = path;
    std::unique_ptr<WorldScene> loaded;
    try
    {
        loaded = makeWorldScene("file", options);
    }
    catch (const ProgramError& error)
    {
        if (error.code() == kExitUnavailable)
            GTEST_SKIP() << error.what();
        throw;
    }
    std::remove(path.c_str());
    EXPECT_EQ(loaded->options().bodies, 35u);
    ASSERT_EQ(loaded->world().getNumCollisionObjects(), 35);
    for (int i = 0; i < 35; ++i)
        EXPECT_LT((origin(*loaded, i) - origin(*saved, i)).length(), btScalar(1e-5)) << i;
    stepMany(*loaded, 60);
    EXPECT_GT(loaded->contactPairCount(), 20u);
    EXPECT_GT(loaded->lowestHeight(), btScalar(0.4));
}

TEST(WorldScenes, NameFilesThatCannotBeRead)
{
    const auto errorOf = [](const std::string& path)
    {
        WorldSceneOptions options = makeOptions(0);
        options.file = path;
        try
        {
            makeWorldScene("file", options);
        }
        catch (const ProgramError& error)
        {
            return std::string(error.what());
        }
        return std::string();
    };
    if (errorOf("").find("extras") != std::string::npos)
        GTEST_SKIP() << errorOf("");
    EXPECT_NE(errorOf("").find("--file"), std::string::npos);
    EXPECT_EQ(errorOf("/nowhere/a.bullet"), "world '/nowhere/a.bullet': cannot be opened");
    const std::string path = temporaryFile("broken.bullet");
    std::ofstream(path) << "BULLE";
    EXPECT_EQ(errorOf(path), "world '" + path + "': not a .bullet file");
    std::remove(path.c_str());
}
}  // namespace
}  // namespace cullet
