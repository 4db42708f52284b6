// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A world of static and sleeping bodies takes the steps of Bullet's world, bit by bit, whatever the application edits, and
// visits its objects as seldom as code of the application permits.
#include "cullet/base/sanitizer.h"
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/core/box_convert.h"
#include "cullet/plugin/shapes/shape_boxes.h"
#include "cullet/plugin/world.h"
#include "cullet/tests/plugin/world/rest_scene.h"
#include "cullet/tests/plugin/world_crowd.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

namespace cullet::test
{
namespace
{
constexpr int kSteps = 900;
constexpr std::uint32_t kSeed = 20260127;

template <class W, class OfContacts = Dispatcher, class OfPairs = Broadphase>
struct RestStage
{
    btDefaultCollisionConfiguration configuration;
    OfContacts dispatcher = makeDispatcher();
    OfPairs broadphase;
    btSequentialImpulseConstraintSolver solver;
    W world{&dispatcher, &broadphase, &solver, &configuration};

private:
    OfContacts makeDispatcher()
    {
        if constexpr (std::is_same_v<OfContacts, Dispatcher>)
        {
            DispatcherOptions options;
            options.threads = 1;
            return Dispatcher(&configuration, options);
        }
        else
            return OfContacts(&configuration);
    }
};

struct RestHistory
{
    std::vector<std::uint64_t> hashes;
    std::array<int, 4> stepsOfPasses{};            ///< [loops over all objects; 3 or more]
    std::array<int, RestScene::kMoments> edits{};  ///< [moment]
    int sleepingSteps = 0;                         ///< in which no pair had an awake body
    int keptSteps = 0;                             ///< in which no island was searched
    int dozingSteps = 0;                           ///< in which the loops left out some bodies, but not all
    std::uint64_t resting = 0;
};

template <class Stage>
RestHistory run(bool updatesAll, int threads, const RestOptions& options = {})
{
    Stage stage;
    constexpr bool kIsOurs = !std::is_same_v<decltype(stage.world), btDiscreteDynamicsWorld>;
    if constexpr (kIsOurs)
        stage.world.setUpdateThreads(threads);
    stage.world.setForceUpdateAllAabbs(updatesAll);
    const btScalar deactivationTime = gDeactivationTime;
    gDeactivationTime = btScalar(0.2);
    RestScene scene(stage.world, kSeed, options);
    RestHistory history;
    for (int step = 0; step < kSteps; ++step)
    {
        scene.step(step);
        history.hashes.push_back(scene.hash() * 31 + hashOfWorld(stage.world));
        if constexpr (std::is_same_v<decltype(stage.dispatcher), Dispatcher>)
            history.sleepingSteps += !stage.dispatcher.hadForeignPairs();
        if constexpr (kIsOurs)
        {
            ++history.stepsOfPasses.at(std::min(stage.world.restStats().passes, 3u));
            history.resting += stage.world.restStats().restingObjects;
            history.keptSteps += stage.world.restStats().keptIslands;
            const std::uint64_t left = stage.world.bodyStats().restingBodies;
            history.dozingSteps += left > 0 && left < std::uint64_t(options.movers);
        }
    }
    for (std::size_t moment = 0; moment < history.edits.size(); ++moment)
        history.edits[moment] = scene.edits(RestScene::Moment(moment));
    gDeactivationTime = deactivationTime;
    return history;
}

/// Expects equal hashes, and says from which step on they differ.
void expectSame(const RestHistory& own, const RestHistory& expected, int threads)
{
    const auto difference = std::mismatch(own.hashes.begin(), own.hashes.end(), expected.hashes.begin());
    EXPECT_EQ(difference.first - own.hashes.begin(), kSteps) << threads << " threads, seed " << kSeed;
}

class WorldRestSteps : public testing::TestWithParam<bool>
{
};

INSTANTIATE_TEST_SUITE_P(ForcedUpdates, WorldRestSteps, testing::Bool(),
                         [](const auto& test) { return test.param ? "On" : "Off"; });

using Rest = World<btDiscreteDynamicsWorld>;

TEST_P(WorldRestSteps, EqualThoseOfBulletWhateverTheApplicationEdits)
{
    const RestHistory expected = run<RestStage<btDiscreteDynamicsWorld>>(GetParam(), 0);
    EXPECT_GT(expected.sleepingSteps, kSteps / 6) << "seed " << kSeed;
    EXPECT_LT(expected.sleepingSteps, kSteps - kSteps / 10);
    for (std::size_t moment = 0; moment < expected.edits.size(); ++moment)
        EXPECT_GT(expected.edits[moment], 3) << "moment " << moment << ", seed " << kSeed;
    for (const int threads : {1, 2, 3})
    {
        const RestHistory own = run<RestStage<Rest>>(GetParam(), threads);
        expectSame(own, expected, threads);
        for (const int passes : {1, 2, 3})
            EXPECT_GT(own.stepsOfPasses[std::size_t(passes)], 10) << passes << " passes";
        EXPECT_GT(own.resting / kSteps, std::uint64_t(RestScene::kStatics) * 8 / 10);
    }
}

/// Enough bodies for the loops of WorldBodies, edited while they sleep.
RestOptions sleepers()
{
    RestOptions options;
    options.movers = 414;
    options.columns = 12;
    options.moverEdits = 0.6f;
    options.editsSleepers = true;
    return options;
}

TEST_P(WorldRestSteps, EqualThoseOfBulletWhateverIsEditedInSleepingBodies)
{
    const RestHistory expected = run<RestStage<btDiscreteDynamicsWorld>>(GetParam(), 0, sleepers());
    for (std::size_t moment = 0; moment < expected.edits.size(); ++moment)
        EXPECT_GT(expected.edits[moment], 3) << "moment " << moment << ", seed " << kSeed;
    for (const int threads : {1, 3})
    {
        const RestHistory own = run<RestStage<Rest>>(GetParam(), threads, sleepers());
        expectSame(own, expected, threads);
        EXPECT_GT(own.keptSteps, kSteps / 60);
        EXPECT_GT(own.dozingSteps, kSteps / 6);
    }
}

TEST_P(WorldRestSteps, EqualThoseOfBulletInSleepingBodiesOfDbvtAndBulletsDispatcher)
{
    using Stock = RestStage<btDiscreteDynamicsWorld, btCollisionDispatcher, btDbvtBroadphase>;
    using Own = RestStage<Rest, btCollisionDispatcher, btDbvtBroadphase>;
    RestOptions options = sleepers();
    options.editsInFilters = false;
    const RestHistory expected = run<Stock>(GetParam(), 0, options);
    for (const int threads : {1, 2})
    {
        const RestHistory own = run<Own>(GetParam(), threads, options);
        expectSame(own, expected, threads);
        EXPECT_GT(own.dozingSteps, kSteps / 6);
    }
}

TEST(ShapeBoxes, EqualThoseOfShapesBitByBit)
{
    const MixedShapes mixed;
    ShapeBoxes boxes;
    Random random(kSeed);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    int computed = 0, valid = 0;
    for (int i = 0; i < 20000; ++i)
    {
        btCollisionShape& shape = *mixed.shapes[random.below(std::uint32_t(mixed.shapes.size()))];
        btTransform transform(
            btQuaternion(random.unit(), random.unit(), random.unit(), random.between(0.1f, 1)),
            vec(random.point(-9, 9)));
        if (random.chance(0.4f))
            transform.getBasis()[int(random.below(3))][int(random.below(3))] =
                random.chance(0.5f) ? kInfinity : -NAN;
        btVector3 min, max, expectedMin, expectedMax;
        if (!boxes.compute(shape, transform, min, max))
            continue;
        shape.getAabb(transform, expectedMin, expectedMax);
        EXPECT_TRUE(isSameBox(min, max, expectedMin, expectedMax)) << shape.getName() << ", seed " << kSeed;
        ++computed;
        valid += isValidBox(min, max);
    }
    EXPECT_GT(computed, 10000);
    EXPECT_GT(valid, computed / 2);
    EXPECT_LT(valid, computed * 9 / 10);
}

TEST(ShapeBoxes, FollowEditedShapeInNextPass)
{
    btBoxShape shape(vec(1, 2, 3));
    btVector3 min, max;
    ASSERT_TRUE(ShapeBoxes().compute(shape, btTransform::getIdentity(), min, max));
    EXPECT_NEAR(max.y(), 2, 1e-6);
    shape.setLocalScaling(vec(2, 2, 2));
    ASSERT_TRUE(ShapeBoxes().compute(shape, btTransform::getIdentity(), min, max));
    EXPECT_NEAR(max.y(), 4, 1e-6);
}

/// A floor of static boxes with one box that lies on it.
template <class W>
class Floor
{
public:
    static constexpr int kTiles = 600;

    Floor()
    {
        stage.world.setUpdateThreads(1);
        for (int i = 0; i < kTiles; ++i)
            add(0, vec(1.1 * (i % 25), 0, 1.1 * (i / 25)));
        add(1, vec(1.1, 1, 1.1));
    }
    ~Floor()
    {
        for (auto& body : bodies)
            stage.world.removeRigidBody(body.get());
    }
    Floor(const Floor&) = delete;
    Floor& operator=(const Floor&) = delete;

    btRigidBody& box() { return *bodies.back(); }
    void sleep()
    {
        step();
        step();
        box().forceActivationState(ISLAND_SLEEPING);
        step();
    }
    WorldRestStats step()
    {
        stage.world.stepSimulation(btScalar(1) / 60, 0);
        return stage.world.restStats();
    }

    RestStage<W> stage;
    std::vector<std::unique_ptr<btRigidBody>> bodies;

private:
    void add(double mass, const btVector3& at)
    {
        bodies.push_back(std::make_unique<btRigidBody>(btScalar(mass), nullptr, &m_shape, vec(1, 1, 1)));
        bodies.back()->setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
        stage.world.addRigidBody(bodies.back().get());
    }
    btBoxShape m_shape{vec(0.5, 0.5, 0.5)};
};

TEST(WorldRest, VisitsAllObjectsOnceInStepOfSleepers)
{
    Floor<Rest> floor;
    floor.sleep();
    const WorldRestStats stats = floor.step();
    EXPECT_EQ(stats.passes, 1u);
    EXPECT_EQ(stats.restingObjects, std::uint64_t(Floor<Rest>::kTiles));
    EXPECT_EQ(stats.restingBoxes, std::uint64_t(Floor<Rest>::kTiles));
}

TEST(WorldRest, ComparesNoBoxesWithoutForcedUpdates)
{
    Floor<Rest> floor;
    floor.stage.world.setForceUpdateAllAabbs(false);
    floor.sleep();
    const WorldRestStats stats = floor.step();
    EXPECT_EQ(stats.passes, 1u);
    EXPECT_EQ(stats.restingObjects, std::uint64_t(Floor<Rest>::kTiles));
    EXPECT_EQ(stats.restingBoxes, 0u);
}

TEST(WorldRest, VisitsAllObjectsOnceWhenOnlyBulletsCodeComputesContacts)
{
    Floor<Rest> floor;
    floor.sleep();
    floor.box().forceActivationState(DISABLE_DEACTIVATION);
    for (int step = 0; step < 5; ++step)
        floor.step();
    const WorldRestStats stats = floor.step();
    EXPECT_EQ(stats.passes, 1u);
    EXPECT_EQ(stats.restingObjects, std::uint64_t(Floor<Rest>::kTiles));
    EXPECT_GT(floor.stage.dispatcher.getNumManifolds(), 0);
}

TEST(WorldRest, VisitsAllObjectsAgainForIslandsWhenContactsCallTheApplication)
{
    Floor<Rest> floor;
    floor.sleep();
    floor.box().forceActivationState(DISABLE_DEACTIVATION);
    gContactProcessedCallback = [](btManifoldPoint&, void*, void*) { return false; };
    for (int step = 0; step < 5; ++step)
        floor.step();
    EXPECT_EQ(floor.step().passes, 2u);
    gContactProcessedCallback = nullptr;
}

TEST(WorldRest, VisitsAllObjectsAgainForIslandsWhenThereAreGhosts)
{
    btGhostPairCallback callback;
    Floor<Rest> floor;
    floor.stage.world.getPairCache()->setInternalGhostPairCallback(&callback);
    btGhostObject ghost;
    btSphereShape ball(1);
    ghost.setCollisionShape(&ball);
    floor.stage.world.addCollisionObject(&ghost);
    floor.sleep();
    const WorldRestStats stats = floor.step();
    EXPECT_EQ(stats.passes, 2u);
    // Bullet makes a ghost a static object.
    EXPECT_EQ(stats.restingObjects, std::uint64_t(Floor<Rest>::kTiles) + 1);
    floor.stage.world.removeCollisionObject(&ghost);
}

TEST(WorldRest, VisitsAllObjectsAgainForBoxesAfterPreTickCallback)
{
    Floor<Rest> floor;
    floor.sleep();
    floor.stage.world.setInternalTickCallback([](btDynamicsWorld*, btScalar) {}, nullptr, true);
    EXPECT_EQ(floor.step().passes, 2u);
}

/// A class of the application, which may replace any function of World.
class OwnWorld : public Rest
{
public:
    using Rest::Rest;
};

TEST(WorldRest, VisitsAllObjectsInEachLoopOfDerivedClass)
{
    Floor<OwnWorld> floor;
    floor.sleep();
    EXPECT_EQ(floor.step().passes, 3u);
}

TEST(WorldRest, ReportsMovedStaticBodyAsRestlessForOneStep)
{
    Floor<Rest> floor;
    floor.sleep();
    floor.bodies[7]->getWorldTransform().getOrigin() += vec(0, 0.25, 0);
    EXPECT_EQ(floor.step().restingObjects, std::uint64_t(Floor<Rest>::kTiles) - 1);
    EXPECT_EQ(floor.step().restingObjects, std::uint64_t(Floor<Rest>::kTiles));
}
}  // namespace
}  // namespace cullet::test
