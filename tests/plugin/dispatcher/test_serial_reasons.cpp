// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/dispatcher/crowd_world.h"

#include <BulletCollision/CollisionDispatch/btCompoundCollisionAlgorithm.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <string>

namespace cullet::test
{
namespace
{
constexpr int kSerialSteps = 40;

/// What an application does to a world before its first step.
using Prepare = std::function<void(CrowdWorld&)>;

/// Sets Bullet's global callbacks back at the end of a test.
class GlobalCallbacks
{
public:
    ~GlobalCallbacks()
    {
        gContactAddedCallback = nullptr;
        gContactProcessedCallback = nullptr;
        gContactStartedCallback = nullptr;
        gContactEndedCallback = nullptr;
        gContactDestroyedCallback = nullptr;
        gCompoundChildShapePairCallback = nullptr;
        gCalculateCombinedRestitutionCallback = &btManifoldResult::calculateCombinedRestitution;
        gCalculateCombinedFrictionCallback = &btManifoldResult::calculateCombinedFriction;
        gCalculateCombinedRollingFrictionCallback = &btManifoldResult::calculateCombinedRollingFriction;
        gCalculateCombinedSpinningFrictionCallback = &btManifoldResult::calculateCombinedSpinningFriction;
        gCalculateCombinedContactDampingCallback = &btManifoldResult::calculateCombinedContactDamping;
        gCalculateCombinedContactStiffnessCallback = &btManifoldResult::calculateCombinedContactStiffness;
    }

    /// @param which 0 to 4
    static void setContact(int which)
    {
        if (which == 0)
            gContactAddedCallback = [](btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                                       const btCollisionObjectWrapper*, int, int) { return isCalled(); };
        else if (which == 1)
            gContactProcessedCallback = [](btManifoldPoint&, void*, void*) { return isCalled(); };
        else if (which == 2)
            gContactStartedCallback = [](btPersistentManifold* const&) { isCalled(); };
        else if (which == 3)
            gContactEndedCallback = [](btPersistentManifold* const&) { isCalled(); };
        else
            gContactDestroyedCallback = [](void*) { return isCalled(); };
    }
    /// @param which 0 to 5
    static void setCombined(int which)
    {
        CalculateCombinedCallback* const all[] = {
            &gCalculateCombinedRestitutionCallback,     &gCalculateCombinedFrictionCallback,
            &gCalculateCombinedRollingFrictionCallback, &gCalculateCombinedSpinningFrictionCallback,
            &gCalculateCombinedContactDampingCallback,  &gCalculateCombinedContactStiffnessCallback};
        *all[which] = [](const btCollisionObject* a, const btCollisionObject*)
        {
            isCalled();
            return a->getFriction() * btScalar(0.5);
        };
    }
    inline static std::atomic<int> calls{0};

private:
    static bool isCalled()
    {
        ++calls;
        return true;
    }
};

template <class Made = Dispatcher, class Configuration = btDefaultCollisionConfiguration>
void expectSerial(SerialReason reason, const Prepare& prepare, Crowd crowd = Crowd::Mixed)
{
    std::vector<std::uint64_t> hashes[2];
    for (const int threads : {1, 3})
    {
        const auto world = makeCrowd<Made, Configuration>(crowd, 5, onThreadCount(threads));
        prepare(*world);
        hashes[threads / 2] = world->run(kSerialSteps);
        if (threads == 1)
            continue;
        EXPECT_EQ(world->stats().reason, reason);
        EXPECT_EQ(world->stats().dispatchesTotal[std::size_t(reason)], std::uint64_t(kSerialSteps));
        EXPECT_EQ(world->stats().jobsTotal, 0u);
        EXPECT_GT(world->points, kSerialSteps * 20);
    }
    EXPECT_TRUE(hashes[0] == hashes[1]);
}

/// A pair cache of the application.
class OwnCache : public btHashedOverlappingPairCache
{
};

/// A configuration with a depth solver of the application.
class OwnDepthConfiguration : public btDefaultCollisionConfiguration
{
public:
    btCollisionAlgorithmCreateFunc* getCollisionAlgorithmCreateFunc(int a, int b) override
    {
        btCollisionAlgorithmCreateFunc* const create =
            btDefaultCollisionConfiguration::getCollisionAlgorithmCreateFunc(a, b);
        return dynamic_cast<btConvexConvexAlgorithm::CreateFunc*>(create) != nullptr ? &m_own : create;
    }

private:
    class OwnSolver : public btGjkEpaPenetrationDepthSolver
    {
    };
    OwnSolver m_solver;
    btConvexConvexAlgorithm::CreateFunc m_own{&m_solver};
};
}  // namespace

TEST(SerialReasons, AreGivenForNearCallbackAndContinuousDispatch)
{
    expectSerial(
        SerialReason::NearCallback,
        [](CrowdWorld& world)
        {
            world.dispatcher().setNearCallback(
                [](btBroadphasePair& pair, btCollisionDispatcher& dispatcher, const btDispatcherInfo& info)
                { btCollisionDispatcher::defaultNearCallback(pair, dispatcher, info); });
        });
    const auto world = makeCrowd(Crowd::Boxes, 5, onThreadCount(3));
    world->world.getDispatchInfo().m_dispatchFunc = btDispatcherInfo::DISPATCH_CONTINUOUS;
    world->step();
    EXPECT_EQ(world->stats().reason, SerialReason::ContinuousDispatch);
    EXPECT_EQ(world->stats().jobsTotal, 0u);
}

TEST(ForeignPairs, AreSeenWhereTheApplicationIsAskedAboutChildren)
{
    const GlobalCallbacks callbacks;
    btDefaultCollisionConfiguration configuration;
    DispatcherOptions options = onThreadCount(1);
    options.callbacksAreThreadSafe = true;
    Dispatcher dispatcher(&configuration, options);
    dispatcher.setFindsForeignPairs(true);
    Broadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
    btBoxShape box(vec(1, 1, 1));
    btCompoundShape pair;
    pair.addChildShape(btTransform(btQuaternion::getIdentity(), vec(-1, 0, 0)), &box);
    pair.addChildShape(btTransform(btQuaternion::getIdentity(), vec(1, 0, 0)), &box);
    btRigidBody floor(0, nullptr, &box), body(1, nullptr, &pair, vec(1, 1, 1));
    body.setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(1, 2, 0)));
    body.setActivationState(DISABLE_DEACTIVATION);
    world.addRigidBody(&floor);
    world.addRigidBody(&body);
    // A new pair is foreign.
    for (const bool isForeign : {true, false, false})
    {
        world.performDiscreteCollisionDetection();
        EXPECT_EQ(dispatcher.hadForeignPairs(), isForeign);
    }
    EXPECT_GT(dispatcher.getNumManifolds(), 0);
    gCompoundChildShapePairCallback = [](const btCollisionShape*, const btCollisionShape*) { return true; };
    world.performDiscreteCollisionDetection();
    EXPECT_TRUE(dispatcher.hadForeignPairs());
    world.removeRigidBody(&body);
    world.removeRigidBody(&floor);
}

TEST(SerialReasons, AreGivenForDerivedDispatcherAndForeignPairCache)
{
    expectSerial<DerivedDispatcher>(SerialReason::DerivedDispatcher, [](CrowdWorld&) {});
    btDefaultCollisionConfiguration configuration;
    Dispatcher dispatcher(&configuration, onThreadCount(2));
    OwnCache own;
    btHashedOverlappingPairCache bullets;
    dispatcher.dispatchAllCollisionPairs(&own, btDispatcherInfo(), &dispatcher);
    EXPECT_EQ(dispatcher.contactStats().reason, SerialReason::UnknownPairCache);
    dispatcher.dispatchAllCollisionPairs(&bullets, btDispatcherInfo(), &dispatcher);
    EXPECT_EQ(dispatcher.contactStats().reason, SerialReason::FewPairs);
}

TEST(SerialReasons, AreGivenForEachContactCallback)
{
    const GlobalCallbacks restoreAtEnd;
    for (int which = 0; which < 5; ++which)
    {
        SCOPED_TRACE(which);
        expectSerial(SerialReason::ContactCallback, [&](CrowdWorld&) { GlobalCallbacks::setContact(which); });
        gContactAddedCallback = nullptr;
        gContactProcessedCallback = nullptr;
        gContactStartedCallback = nullptr;
        gContactEndedCallback = nullptr;
    }
}

TEST(SerialReasons, AreGivenForEachCallbackThatCombinesMaterials)
{
    for (int which = 0; which < 6; ++which)
    {
        SCOPED_TRACE(which);
        const GlobalCallbacks restoreAtEnd;
        expectSerial(SerialReason::CombinedCallback,
                     [&](CrowdWorld&) { GlobalCallbacks::setCombined(which); });
    }
}

TEST(SerialReasons, AreGivenForManifoldLimitSeparatingAxisTestAndDepthSolver)
{
    expectSerial(SerialReason::ManifoldLimit,
                 [](CrowdWorld& world)
                 {
                     world.dispatcher().setDispatcherFlags(
                         world.dispatcher().getDispatcherFlags() |
                         btCollisionDispatcher::CD_DISABLE_CONTACTPOOL_DYNAMIC_ALLOCATION);
                 });
    expectSerial(SerialReason::SeparatingAxisTest,
                 [](CrowdWorld& world) { world.world.getDispatchInfo().m_enableSatConvex = true; });
    expectSerial<Dispatcher, OwnDepthConfiguration>(SerialReason::DepthSolver, [](CrowdWorld&) {});
}

// The order of the calls is that of the threads, so they are only counted.
TEST(SerialReasons, AreNoneForCallbacksThatAreThreadSafe)
{
    std::vector<std::uint64_t> hashes[2];
    int calls[2];
    for (const bool isSafe : {false, true})
    {
        const GlobalCallbacks restoreAtEnd;
        GlobalCallbacks::setContact(1);
        GlobalCallbacks::setContact(2);
        GlobalCallbacks::setContact(3);
        GlobalCallbacks::setCombined(1);
        DispatcherOptions options = onThreadCount(3);
        options.callbacksAreThreadSafe = isSafe;
        const auto world = makeCrowd(Crowd::Hulls, 6, options);
        GlobalCallbacks::calls = 0;
        hashes[isSafe] = world->run(kSerialSteps);
        calls[isSafe] = GlobalCallbacks::calls;
        EXPECT_EQ(world->stats().reason, isSafe ? SerialReason::None : SerialReason::ContactCallback);
        EXPECT_EQ(world->stats().dividedTotal > 1000, isSafe);
    }
    EXPECT_TRUE(hashes[0] == hashes[1]);
    EXPECT_EQ(calls[0], calls[1]);
    EXPECT_GT(calls[0], 1000);
}

TEST(SerialReasons, LeavePartAndIndexOfWholeShapesAtMinusOneOnEveryPath)
{
    static std::atomic<int> others;
    for (const bool isSafe : {false, true})
    {
        const GlobalCallbacks restoreAtEnd;
        others = GlobalCallbacks::calls = 0;
        gContactAddedCallback = [](btManifoldPoint&, const btCollisionObjectWrapper* a, int partA, int indexA,
                                   const btCollisionObjectWrapper* b, int partB, int indexB)
        {
            const bool areWhole = a->m_partId == -1 && a->m_index == -1 && b->m_partId == -1 &&
                                  b->m_index == -1 && partA == -1 && indexA == -1 && partB == -1 &&
                                  indexB == -1;
            others += areWhole ? 0 : 1;
            ++GlobalCallbacks::calls;
            return true;
        };
        DispatcherOptions options = onThreadCount(3);
        options.callbacksAreThreadSafe = isSafe;
        const auto world = makeCrowd(Crowd::Mixed, 7, options);
        for (const auto& body : world->bodies)
            body->setCollisionFlags(body->getCollisionFlags() |
                                    btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
        world->run(kSerialSteps);
        EXPECT_EQ(world->stats().dividedTotal > 1000, isSafe);
        EXPECT_GT(GlobalCallbacks::calls, 1000);
        EXPECT_EQ(others, 0);
    }
}
}  // namespace cullet::test
