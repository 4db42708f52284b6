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
constexpr int kSteps = 600;
constexpr std::uint32_t kSeed = 20260127;

template <class W>
struct RestStage
{
    btDefaultCollisionConfiguration configuration;
    Dispatcher dispatcher{&configuration, oneThread()};
    Broadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    W world{&dispatcher, &broadphase, &solver, &configuration};

    static DispatcherOptions oneThread()
    {
        DispatcherOptions options;
        options.threads = 1;
        return options;
    }
};

struct RestHistory
{
    std::vector<std::uint64_t> hashes;
    std::array<int, 4> stepsOfPasses{};  ///< [loops over all objects]
    std::array<int, 9> edits{};          ///< [moment]
    int sleepingSteps = 0;
    std::uint64_t resting = 0;
};

template <class W>
RestHistory run(bool updatesAll, int threads)
{
    RestStage<W> stage;
    constexpr bool kIsOurs = !std::is_same_v<W, btDiscreteDynamicsWorld>;
    if constexpr (kIsOurs)
        stage.world.setUpdateThreads(threads);
    stage.world.setForceUpdateAllAabbs(updatesAll);
    const btScalar deactivationTime = gDeactivationTime;
    gDeactivationTime = btScalar(0.2);
    RestScene scene(stage.world, kSeed);
    RestHistory history;
    for (int step = 0; step < kSteps; ++step)
    {
        scene.step(step);
        history.hashes.push_back(scene.hash() * 31 + hashOfWorld(stage.world));
        history.sleepingSteps += !stage.dispatcher.hadForeignPairs();
        if constexpr (kIsOurs)
        {
            ++history.stepsOfPasses.at(stage.world.restStats().passes);
            history.resting += stage.world.restStats().restingObjects;
        }
    }
    for (std::size_t moment = 0; moment < history.edits.size(); ++moment)
        history.edits[moment] = scene.edits(RestScene::Moment(moment));
    gDeactivationTime = deactivationTime;
    return history;
}

class WorldRestSteps : public testing::TestWithParam<bool>
{
};

INSTANTIATE_TEST_SUITE_P(ForcedUpdates, WorldRestSteps, testing::Bool(),
                         [](const auto& test) { return test.param ? "On" : "Off"; });

TEST_P(WorldRestSteps, EqualThoseOfBulletWhateverTheApplicationEdits)
{
    const RestHistory expected = run<btDiscreteDynamicsWorld>(GetParam(), 0);
    EXPECT_GT(expected.sleepingSteps, kSteps / 6) << "seed " << kSeed;
    EXPECT_LT(expected.sleepingSteps, kSteps - kSteps / 10);
    for (std::size_t moment = 0; moment < expected.edits.size(); ++moment)
        EXPECT_GT(expected.edits[moment], 3) << "moment " << moment << ", seed " << kSeed;
    for (const int threads : {1, 2, 3})
    {
        const RestHistory own = run<World<btDiscreteDynamicsWorld>>(GetParam(), threads);
        const auto difference = std::mismatch(own.hashes.begin(), own.hashes.end(), expected.hashes.begin());
        EXPECT_EQ(difference.first - own.hashes.begin(), kSteps) << threads << " threads, seed " << kSeed;
        for (const int passes : {1, 2, 3})
            EXPECT_GT(own.stepsOfPasses[std::size_t(passes)], kSteps / 60) << passes << " passes";
        EXPECT_GT(own.resting / kSteps, std::uint64_t(RestScene::kStatics) * 8 / 10);
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

using Rest = World<btDiscreteDynamicsWorld>;

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
