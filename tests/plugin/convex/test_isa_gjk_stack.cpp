// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Stack usage of the narrow phase: threads and fibres of applications may have 64 kB.

#include "cullet/base/sanitizer.h"
#include "cullet/demos/scenes/hulls/hull_points.h"
#include "cullet/demos/scenes/hulls/hull_queries.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/epa/exact_penetration.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/world.h"
#include "cullet/tests/plugin/convex/convex_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <pthread.h>
#include <vector>

namespace cullet::test
{
namespace
{
#if defined(CULLET_IS_SANITIZED) || !defined(__OPTIMIZE__)
// Sanitizers pad variables, or give each its own memory.
constexpr std::size_t kMost = 1024 * 1024, kLeast = 1024;
#else
constexpr std::size_t kMost = 48 * 1024, kLeast = 4096;
#endif
constexpr std::size_t kStack = 4 * kMost;

/// A stack with a pattern, to measure its used part.
class PaintedStack
{
public:
    /// Stack bytes that code uses on a separate thread.
    std::size_t usedBy(const std::function<void()>& code)
    {
        std::fill(m_memory.begin(), m_memory.end(), kPaint);
        pthread_attr_t attributes;
        pthread_attr_init(&attributes);
        EXPECT_EQ(pthread_attr_setstack(&attributes, base(), kStack), 0);
        pthread_t thread;
        EXPECT_EQ(pthread_create(&thread, &attributes, run, const_cast<std::function<void()>*>(&code)), 0);
        pthread_join(thread, nullptr);
        pthread_attr_destroy(&attributes);
        const std::byte* const end = base() + kStack;
        return static_cast<std::size_t>(
            end - std::find_if(base(), base() + kStack, [](std::byte b) { return b != kPaint; }));
    }

private:
    static constexpr std::byte kPaint = std::byte(0xa5);
    static constexpr std::size_t kPage = 4096;

    static void* run(void* code)
    {
        (*static_cast<std::function<void()>*>(code))();
        return nullptr;
    }

    std::byte* base()
    {
        void* place = m_memory.data();
        std::size_t room = m_memory.size();
        return static_cast<std::byte*>(std::align(kPage, kStack, place, room));
    }

    std::vector<std::byte> m_memory = std::vector<std::byte>(kStack + kPage);
};

/// Stack bytes of the contacts of two bodies, as in a step, with the graphs of their hulls.
std::size_t stackOf(btConvexShape& a, btConvexShape& b, const btVector3& apart, IsaGjkStats& stats)
{
    ConvexWorld world(Narrow::IsaGjk);
    world.add(&a, 1, vec(0, 0, 0));
    world.add(&b, 1, apart);
    PaintedStack stack;
    const std::size_t nothing = stack.usedBy([] {});
    const std::size_t used = stack.usedBy(
        [&]
        {
            // The second step uses the cache.
            world.world.performDiscreteCollisionDetection();
            world.world.performDiscreteCollisionDetection();
        });
    stats = world.stats();
    EXPECT_GT(world.dispatcher().getNumManifolds(), 0);
    EXPECT_GT(world.dispatcher().getManifoldByIndexInternal(0)->getNumContacts(), 0);
    return used - nothing;
}
}  // namespace

TEST(IsaGjkStack, StaysWithinLimitForRoundHullsWhoseCentresNearlyCoincide)
{
    for (const int count : {100, 400, 1000})
    {
        // New points, since the graphs of equal points would exist already.
        const auto a = makeHullShape(ballPoints(count, 1.0, 71)),
                   b = makeHullShape(ballPoints(count, 1.0, 72));
        for (const double apart : {1e-3, 0.0, 0.05})
        {
            IsaGjkStats stats;
            const std::size_t used = stackOf(*a, *b, vec(apart, 0, 0), stats);
            EXPECT_LT(used, kMost) << count << " points, " << apart << " m apart";
            EXPECT_EQ(stats.depthsTotal, 2u);
            RecordProperty("bytes" + std::to_string(count), static_cast<int>(used));
        }
    }
}

TEST(IsaGjkStack, StaysWithinLimitForExactDepths)
{
    using Scalar = btScalar;
    std::vector<Eigen::Matrix<Scalar, 3, 1>> points;
    for (const btVector3& point : ballPoints(400, 1.0, 73))
        points.emplace_back(point.x(), point.y(), point.z());
    const Hull<Scalar> hull = makeHull(points);
    const PosedHull<Scalar> a(hull, Eigen::Matrix<Scalar, 3, 3>::Identity(), {0, 0, 0});
    const PosedHull<Scalar> b(hull, Eigen::Matrix<Scalar, 3, 3>::Identity(), {Scalar(0.1), 0, 0});
    PaintedStack stack;
    bool isFound = false;
    const std::size_t used = stack.usedBy(
        [&]
        {
            Eigen::Vector3d normal;
            double depth;
            isFound = exactPenetration(a, b, normal, depth);
        });
    EXPECT_TRUE(isFound);
    EXPECT_LT(used, kMost);
}

namespace
{
/// Stack bytes of the queries of two hulls, one after the other.
template <class Scalar>
std::size_t stackOfQueries(int count, double apart)
{
    using Vector = Eigen::Matrix<Scalar, 3, 1>;
    std::vector<Vector> points;
    for (const btVector3& point : ballPoints(count, 1.0, 74))
        points.emplace_back(Scalar(point.x()), Scalar(point.y()), Scalar(point.z()));
    const Hull<Scalar> hull = makeHull(points);
    const PosedHull<Scalar> a(hull, Eigen::Matrix<Scalar, 3, 3>::Identity(), Vector::Zero());
    const PosedHull<Scalar> b(hull, Eigen::Matrix<Scalar, 3, 3>::Identity(), {Scalar(apart), 0, 0});
    PaintedStack stack;
    const std::size_t nothing = stack.usedBy([] {});
    GjkState state = GjkState::NotConverged;
    const std::size_t used = stack.usedBy(
        [&]
        {
            GjkCache<Scalar> first, second;
            isaGjk(a, b, Scalar(0), first);
            gjkDistance(a, b, Scalar(10), second);
            state = penetration(a, b, first).state;
        });
    EXPECT_EQ(state, apart < 1 ? GjkState::Overlapping : GjkState::Separated) << apart;
    return used - nothing;
}
}  // namespace

TEST(IsaGjkStack, StaysWithinLimitForQueriesOfNarrowPhaseAlone)
{
    std::size_t most = 0;
    for (const int count : {20, 400})
    {
        for (const double apart : {0.0, 1e-3, 0.5, 5.0})
            most =
                std::max({most, stackOfQueries<float>(count, apart), stackOfQueries<double>(count, apart)});
    }
    EXPECT_LT(most, kMost);
    EXPECT_GT(most, kLeast);
    RecordProperty("bytesOfQueries", static_cast<int>(most));
}

namespace
{
/// Stack bytes of steps of a world with all of cullet, whose bodies begin in two heaps of nearly coincident hulls.
std::size_t stackOfSteps(int threads, int bodyCount)
{
    btDefaultCollisionConfiguration configuration;
    DispatcherOptions options;
    options.threads = threads;
    Dispatcher dispatcher(&configuration, options);
    Broadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    World<btDiscreteDynamicsWorld> world(&dispatcher, &broadphase, &solver, &configuration);
    world.setUpdateThreads(threads);
    const auto round = makeHullShape(ballPoints(400, 1.0, 75));
    btCapsuleShape capsule(btScalar(0.3), 1);
    btBoxShape box(vec(0.5, 0.5, 0.5));
    btCollisionShape* const shapes[] = {round.get(), &capsule, &box};
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    for (int i = 0; i < bodyCount; ++i)
    {
        btRigidBody::btRigidBodyConstructionInfo info(1, nullptr, shapes[i % 3], vec(1, 1, 1));
        // Pairs lie at nearly the same place, beside other pairs.
        info.m_startWorldTransform.setOrigin(vec(1.5 * (i / 2 % 10), 1.5 * (i / 20), 1e-3 * (i % 2)));
        bodies.push_back(std::make_unique<btRigidBody>(info));
        world.addRigidBody(bodies.back().get());
    }
    PaintedStack stack;
    const std::size_t nothing = stack.usedBy([] {});
    const std::size_t used = stack.usedBy(
        [&]
        {
            for (int step = 0; step < 3; ++step)
                world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
        });
    EXPECT_GT(dispatcher.getNumManifolds(), bodyCount / 2);
    for (auto& body : bodies)
        world.removeRigidBody(body.get());
    return used - nothing;
}
}  // namespace

TEST(IsaGjkStack, StaysWithinLimitInStepsOfWorldWithAllOfCullet)
{
    std::size_t most = 0;
    // Enough bodies for loops on several threads and for the grid.
    for (const int bodyCount : {40, 700})
    {
        for (const int threads : {1, 2})
            most = std::max(most, stackOfSteps(threads, bodyCount));
    }
    EXPECT_LT(most, kMost);
    EXPECT_GT(most, kLeast);
    RecordProperty("bytesOfSteps", static_cast<int>(most));
}

TEST(IsaGjkStack, StaysWithinLimitForContactPatches)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    const auto drum = makeHullShape(ballPoints(30, 0.5, 8));
    const auto sheet = makeHullShape(boxPoints(1, 1, 0));
    btBoxShape box(vec(0.5, 0.5, 0.5));
    std::size_t most = 0;
    for (btConvexShape* a : std::vector<btConvexShape*>{cube.get(), drum.get(), sheet.get(), &box})
    {
        for (btConvexShape* b : std::vector<btConvexShape*>{cube.get(), sheet.get()})
        {
            IsaGjkStats stats;
            most = std::max(most, stackOf(*a, *b, vec(0.3, 0, 0), stats));
        }
    }
    EXPECT_LT(most, kMost);
    EXPECT_GT(most, kLeast);
}
}  // namespace cullet::test
