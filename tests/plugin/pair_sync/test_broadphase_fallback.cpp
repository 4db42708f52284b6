// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/backends.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/broadphase/exact_oracle.h"
#include "cullet/tests/plugin/log_scope.h"
#include "cullet/tests/plugin/pair_sync/fake_backends.h"

#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// Boxes in a heap on the ground; the result is the algorithms of all pairs by ids.
class HeapWorld
{
public:
    explicit HeapWorld(std::unique_ptr<Backend> backend) : broadphase(std::move(backend))
    {
        add(&groundShape, 0, vec(0, -1, 0));
        for (int i = 0; i < 30; ++i)
            add(&boxShape, 1, vec(1.02 * (i % 5), 0.5 + 1.02 * (i / 5), 0));
    }
    ~HeapWorld()
    {
        for (auto& body : bodies)
            world.removeRigidBody(body.get());
    }
    HeapWorld(const HeapWorld&) = delete;
    HeapWorld& operator=(const HeapWorld&) = delete;

    void add(btCollisionShape* shape, double mass, const btVector3& at)
    {
        btVector3 inertia(0, 0, 0);
        if (mass > 0)
            shape->calculateLocalInertia(btScalar(mass), inertia);
        bodies.push_back(std::make_unique<btRigidBody>(btScalar(mass), nullptr, shape, inertia));
        bodies.back()->setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
        bodies.back()->setInterpolationWorldTransform(bodies.back()->getWorldTransform());
        world.addRigidBody(bodies.back().get());
    }
    std::map<std::uint64_t, btCollisionAlgorithm*> algorithms()
    {
        std::map<std::uint64_t, btCollisionAlgorithm*> found;
        const btBroadphasePairArray& pairs = world.getPairCache()->getOverlappingPairArray();
        for (int i = 0; i < pairs.size(); ++i)
            found[pairKey({idOf(pairs[i].m_pProxy0), idOf(pairs[i].m_pProxy1)})] = pairs[i].m_algorithm;
        return found;
    }
    /// Takes a body out of the heap, so that its pairs end.
    void lift(std::size_t index)
    {
        btRigidBody& body = *bodies[index];
        btTransform at = body.getWorldTransform();
        at.getOrigin().setY(at.getOrigin().y() + 30);
        body.setWorldTransform(at);
        body.setInterpolationWorldTransform(at);
        body.activate();
    }
    void step() { world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60); }

    btBoxShape groundShape{vec(50, 1, 50)};
    btBoxShape boxShape{vec(0.5, 0.5, 0.5)};
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btSequentialImpulseConstraintSolver solver;
    Broadphase broadphase;
    btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
    std::vector<std::unique_ptr<btRigidBody>> bodies;
};

std::unique_ptr<Backend> makeRowsBackend()
{
    GridOptions rows;
    rows.flatLimit = 0;
    return makeGridBackend(rows);
}

TEST(BroadphaseFallback, KeepsPairsAndAlgorithmsAndWarnsOnceWhenBackendFails)
{
    for (const Status failure : {Status::DeviceLost, Status::OutOfMemory})
    {
        const LogScope log;
        HeapWorld scene(std::make_unique<FailingBackend>(20, failure));
        for (int step = 0; step < 20; ++step)
            scene.step();
        ASSERT_STREQ(scene.broadphase.backend().name(), "failing");
        const auto before = scene.algorithms();
        ASSERT_GT(before.size(), 50u);
        scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
        EXPECT_EQ(scene.algorithms(), before) << "pointer-equal";
        EXPECT_STREQ(scene.broadphase.backend().name(), makeGridBackend()->name());
        EXPECT_EQ(scene.broadphase.stats().fallbacksTotal, 1u);
        ASSERT_EQ(loggedLines().size(), 1u);
        EXPECT_NE(loggedLines()[0].find("'failing'"), std::string::npos) << loggedLines()[0];
        for (int step = 0; step < 20; ++step)
            scene.step();
        EXPECT_EQ(loggedLines().size(), 1u);
        EXPECT_GT(scene.algorithms().size(), 50u);
    }
}

TEST(BroadphaseFallback, ContinuesWorldBitForBitWhenBackendFails)
{
    const LogScope log;
    HeapWorld failing(std::make_unique<FailingBackend>(10, Status::DeviceLost));
    HeapWorld healthy(makeBruteForceBackend());
    for (int step = 0; step < 100; ++step)
    {
        failing.step();
        healthy.step();
        for (std::size_t i = 0; i < healthy.bodies.size(); ++i)
        {
            ASSERT_EQ(failing.bodies[i]->getWorldTransform().getOrigin(),
                      healthy.bodies[i]->getWorldTransform().getOrigin())
                << "step " << step;
        }
    }
    EXPECT_EQ(failing.broadphase.stats().fallbacksTotal, 1u);
}

TEST(BroadphaseFallback, HandlesFailureInFirstUpdatesWithPendingPairs)
{
    struct Nobody final : btOverlapFilterCallback
    {
        bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
        {
            return a->m_uniqueId > 2 && b->m_uniqueId > 2;
        }
    } filter;
    const LogScope log;
    for (const int goodUpdates : {0, 1, 2})
    {
        Broadphase broadphase(std::make_unique<FailingBackend>(goodUpdates, Status::DeviceLost));
        broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
        for (int i = 0; i < 4; ++i)
            addCube(broadphase, vec(0.1 * i, 0, 0));
        for (int step = 0; step < 4; ++step)
        {
            EXPECT_EQ(updatedPairs(broadphase), (Pairs{{3, 4}}));
            EXPECT_EQ(broadphase.stats().pendingPairs, 5u);
        }
    }
}

TEST(BroadphaseFallback, KeepsPairsAndAlgorithmsWhenBackendIsReplaced)
{
    HeapWorld scene(makeBruteForceBackend());
    HeapWorld undisturbed(makeBruteForceBackend());
    const auto stepBoth = [&]
    {
        for (int step = 0; step < 10; ++step)
        {
            scene.step();
            undisturbed.step();
            ASSERT_EQ(pairsOf(scene.broadphase), pairsOf(undisturbed.broadphase)) << step;
        }
    };
    // Before the first update.
    scene.broadphase.setBackend(makeLeGrandBackend());
    scene.broadphase.setBackend(makeGridBackend());
    stepBoth();
    std::size_t body = 10;
    for (const auto& make : {makeRowsBackend, makeSapBackend, makeBruteForceBackend})
    {
        const std::string name = make()->name();
        SCOPED_TRACE(name);
        const auto before = scene.algorithms();
        ASSERT_GT(before.size(), 50u);
        scene.broadphase.setBackend(make());
        EXPECT_EQ(scene.algorithms(), before) << "before the update";
        for (int update = 0; update < 2; ++update)
        {
            scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
            EXPECT_EQ(scene.algorithms(), before) << "update " << update;
        }
        EXPECT_EQ(scene.broadphase.backend().name(), name);
        stepBoth();
        // Twice in a row, and pairs end in the first update of the second, which has not reported them.
        scene.broadphase.setBackend(makeLeGrandBackend());
        scene.broadphase.setBackend(make());
        scene.lift(body);
        undisturbed.lift(body);
        ++body;
        stepBoth();
    }
    for (std::size_t i = 0; i < scene.bodies.size(); ++i)
        EXPECT_EQ(scene.bodies[i]->getWorldTransform().getOrigin(),
                  undisturbed.bodies[i]->getWorldTransform().getOrigin());
}

TEST(BroadphaseFallback, GivesExistingPairsToBackendSetByCallbackDuringUpdate)
{
    struct Replacing final : btOverlapFilterCallback
    {
        bool needBroadphaseCollision(btBroadphaseProxy*, btBroadphaseProxy*) const override
        {
            if (broadphase != nullptr)
                broadphase->setBackend(makeBruteForceBackend());
            return true;
        }
        Broadphase* broadphase = nullptr;
    };
    Replacing filter;
    Broadphase broadphase(bruteOptions());
    broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
    btBroadphaseProxy* first = addCube(broadphase, vec(0, 0, 0));
    addCube(broadphase, vec(0.5, 0, 0));
    ASSERT_EQ(updatedPairs(broadphase).size(), 1u);
    addCube(broadphase, vec(0.7, 0, 0));
    filter.broadphase = &broadphase;
    EXPECT_EQ(updatedPairs(broadphase).size(), 3u);
    filter.broadphase = nullptr;
    moveCube(broadphase, first, vec(9, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{2, 3}})) << "pairs from before the new backend leave, too";
}

TEST(BroadphaseFallback, UsesGridWhenBackendIsNull)
{
    const LogScope log;
    Broadphase broadphase(std::unique_ptr<Backend>(), nullptr, bruteOptions());
    EXPECT_STREQ(broadphase.backend().name(), makeGridBackend()->name());
    EXPECT_EQ(loggedLines().size(), 1u);
    addCube(broadphase, vec(0, 0, 0));
    addCube(broadphase, vec(0.5, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
}

TEST(BroadphaseFallback, KeepsPresentBackendWhenNullIsSet)
{
    const LogScope log;
    Broadphase broadphase(bruteOptions());
    addCube(broadphase, vec(0, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    const Backend* before = &broadphase.backend();
    broadphase.setBackend(nullptr);
    ASSERT_EQ(&broadphase.backend(), before);
    EXPECT_EQ(loggedLines().size(), 1u);
    addCube(broadphase, vec(0.5, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
    EXPECT_EQ(broadphase.stats().restartsTotal, 0u) << "nothing has happened";
}

TEST(BroadphaseFallback, UsesGridWhenCudaIsRequestedWithoutDevice)
{
    const LogScope log;
    BroadphaseOptions options;
    options.backend = BackendChoice::Cuda;
    if (makeCudaPsapBackend() != nullptr)
        GTEST_SKIP() << "there is a device";
    Broadphase asked(options);
    EXPECT_STREQ(asked.backend().name(), makeGridBackend()->name());
    EXPECT_EQ(loggedLines().size(), 1u) << "what was asked for cannot be had";
    Broadphase automatic;
    EXPECT_STREQ(automatic.backend().name(), makeGridBackend()->name());
    EXPECT_EQ(loggedLines().size(), 1u) << "nothing was asked for";
}
}  // namespace
}  // namespace cullet::test
