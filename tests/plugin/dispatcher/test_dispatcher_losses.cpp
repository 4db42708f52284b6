// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The cases of `cullet bench losses` that are about the narrow phase, by counts of queries and triangles. A loss that comes
// back fails here without a clock.
#include "cullet/plugin/world.h"
#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/support/random.h"

#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <gtest/gtest.h>

#include <cmath>

namespace cullet::test
{
namespace
{
/// What steps of a world asked the narrow phase.
struct Asked
{
    std::uint64_t pairs = 0;  ///< overlapping pairs of boxes, summed over the steps
    IsaGjkStats queries;
};

std::uint64_t queriesOf(const IsaGjkStats& stats)
{
    return stats.separatedTotal + stats.touchingTotal + stats.delegatedTotal + stats.notConvergedTotal;
}

Asked askedIn(ConvexWorld& world, int steps)
{
    Asked asked;
    for (int step = 0; step < steps; ++step)
    {
        world.step();
        asked.pairs += static_cast<std::uint64_t>(
            world.world.getBroadphase()->getOverlappingPairCache()->getNumOverlappingPairs());
    }
    asked.queries = world.stats();
    return asked;
}

/// A static mesh of triangles with edges of half a metre, a little rough, of 16 m by 16.
class RoughMesh
{
public:
    RoughMesh()
    {
        cullet::test::Random random(40);
        constexpr int kReach = 16, kSide = 2 * kReach + 1;
        std::vector<btVector3> corners;
        for (int i = 0; i < kSide * kSide; ++i)
            corners.push_back(vec(0.5 * (i % kSide - kReach), double(random.point(-0.02f, 0.02f)[0]),
                                  0.5 * (i / kSide - kReach)));
        for (int i = 0; i + kSide < kSide * kSide; ++i)
        {
            if (i % kSide == kSide - 1)
                continue;
            const auto at = static_cast<std::size_t>(i);
            m_triangles.addTriangle(corners[at], corners[at + kSide], corners[at + 1]);
            m_triangles.addTriangle(corners[at + 1], corners[at + kSide], corners[at + kSide + 1]);
        }
        m_shape = std::make_unique<btBvhTriangleMeshShape>(&m_triangles, true);
    }
    btCollisionShape* shape() { return m_shape.get(); }

private:
    btTriangleMesh m_triangles;
    std::unique_ptr<btBvhTriangleMeshShape> m_shape;
};

/// A torus of 128 triangles, 1.1 m wide and 0.3 m high.
class Torus
{
public:
    Torus()
    {
        constexpr int kAround = 8, kAcross = 8;
        const auto corner = [](int around, int across)
        {
            const double a = 6.2831853 * around / kAround, b = 6.2831853 * across / kAcross;
            const double radius = 0.4 + 0.15 * std::cos(b);
            return vec(radius * std::cos(a), 0.15 * std::sin(b), radius * std::sin(a));
        };
        for (int i = 0; i < kAround * kAcross; ++i)
        {
            const int around = i / kAcross, across = i % kAcross;
            m_triangles.addTriangle(corner(around, across), corner(around, across + 1),
                                    corner(around + 1, across));
            m_triangles.addTriangle(corner(around + 1, across), corner(around, across + 1),
                                    corner(around + 1, across + 1));
        }
        m_shape = std::make_unique<btGImpactMeshShape>(&m_triangles);
        m_shape->updateBound();
    }
    btCollisionShape* shape() { return m_shape.get(); }

private:
    btTriangleMesh m_triangles;
    std::unique_ptr<btGImpactMeshShape> m_shape;
};

std::uint64_t pointsOf(btCollisionDispatcher& dispatcher)
{
    std::uint64_t points = 0;
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
        points += static_cast<std::uint64_t>(dispatcher.getManifoldByIndexInternal(i)->getNumContacts());
    return points;
}

/// Places boxes of a metre, loosely one upon the other.
template <class AddBox>
void placeFallingBoxes(AddBox addBox)
{
    cullet::test::Random random(40);
    constexpr int kEdge = 6;
    for (int i = 0; i < kEdge * kEdge * kEdge; ++i)
        addBox(vec(1.3 * (i % kEdge), 0.6 + 1.3 * (i / kEdge / kEdge), 1.3 * (i / kEdge % kEdge)) +
               vec(random.point(-0.1f, 0.1f)));
}

/// Bullet's solver, which counts what it is given.
struct CountingSolver final : btSequentialImpulseConstraintSolver
{
    btScalar solveGroup(btCollisionObject** objects, int objectCount, btPersistentManifold** contacts,
                        int contactCount, btTypedConstraint** joints, int jointCount,
                        const btContactSolverInfo& info, btIDebugDraw* drawer, btDispatcher* owner) override
    {
        ++calls;
        bodies += static_cast<std::uint64_t>(objectCount);
        manifolds += static_cast<std::uint64_t>(contactCount);
        return btSequentialImpulseConstraintSolver::solveGroup(objects, objectCount, contacts, contactCount,
                                                               joints, jointCount, info, drawer, owner);
    }
    std::uint64_t calls = 0, bodies = 0, manifolds = 0;
};

/// What a world with cullet's broad phase does while boxes fall.
struct FallWork
{
    std::uint64_t boxTests = 0, pairs = 0, points = 0, queries = 0;
    std::uint64_t solverCalls = 0, solvedBodies = 0, solvedManifolds = 0;
};

template <class AnyWorld, class AnyDispatcher>
FallWork workOfFall()
{
    FallWork work;
    btDefaultCollisionConfiguration configuration;
    AnyDispatcher dispatcher(&configuration);
    BroadphaseOptions options;
    options.backend = BackendChoice::Grid;
    options.threads = 1;
    Broadphase broadphase(options);
    CountingSolver solver;
    AnyWorld world(&dispatcher, &broadphase, &solver, &configuration);
    if constexpr (std::is_same_v<AnyDispatcher, Dispatcher>)
        world.setUpdateThreads(1);
    btBoxShape ground(vec(40, 1, 40)), box(vec(0.5, 0.5, 0.5));
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    const auto add = [&](btCollisionShape* shape, double mass, const btVector3& at)
    {
        bodies.push_back(makeBodyAt(btTransform(btQuaternion::getIdentity(), at), shape, mass));
        world.addRigidBody(bodies.back().get());
    };
    add(&ground, 0, vec(0, -1, 0));
    placeFallingBoxes([&](const btVector3& at) { add(&box, 1, at); });
    for (int step = 0; step < 100; ++step)
    {
        world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
        work.boxTests += broadphase.stats().backend.candidates;
        work.pairs += broadphase.stats().pairs;
        work.points += pointsOf(dispatcher);
    }
    if constexpr (std::is_same_v<AnyDispatcher, Dispatcher>)
        work.queries = queriesOf(dispatcher.stats());
    work.solverCalls = solver.calls;
    work.solvedBodies = solver.bodies;
    work.solvedManifolds = solver.manifolds;
    for (auto& body : bodies)
        world.removeRigidBody(body.get());
    return work;
}
}  // namespace

TEST(DispatcherLosses, AskOnceForEachPairOfPyramidInEachStep)
{
    btBoxShape ground(vec(40, 1, 40)), box(vec(0.5, 0.5, 0.5));
    ConvexWorld world(Narrow::Dispatcher);
    world.add(&ground, 0, vec(0, -1, 0));
    constexpr int kRows = 10;
    for (int row = 0; row < kRows; ++row)
    {
        for (int i = 0; i < kRows - row; ++i)
            world.add(&box, 1, vec(1.02 * i + 0.51 * row, 0.5 + row, 0))
                .setActivationState(DISABLE_DEACTIVATION);
    }
    const Asked asked = askedIn(world, 60);
    EXPECT_GT(asked.pairs, 60u * 100);
    EXPECT_GT(asked.queries.touchingTotal, asked.pairs / 4);
    // The pairs of a step are those before it.
    EXPECT_LE(queriesOf(asked.queries), asked.pairs + asked.pairs / 10);
    EXPECT_EQ(asked.queries.notConvergedTotal, 0u);
}

TEST(DispatcherLosses, DropSomeTrianglesInBoxesOfBodiesThatLieOnMesh)
{
    RoughMesh mesh;
    btCylinderShape cylinder(vec(0.5, 0.5, 0.5));
    btBoxShape part(vec(0.1, 0.1, 0.1));
    btCompoundShape compound;
    for (int i = 0; i < 25; ++i)
        compound.addChildShape(
            btTransform(btQuaternion::getIdentity(), vec(0.25 * (i % 5 - 2), 0, 0.25 * (i / 5 - 2))), &part);
    for (btCollisionShape* shape :
         {static_cast<btCollisionShape*>(&cylinder), static_cast<btCollisionShape*>(&compound)})
    {
        ConvexWorld world(Narrow::Dispatcher);
        world.add(mesh.shape(), 0, vec(0, 0, 0));
        for (int i = 0; i < 16; ++i)
            world.add(shape, 1, vec(3 * (i % 4) - 5, shape == &cylinder ? 0.55 : 0.15, 3 * (i / 4) - 5));
        const IsaGjkStats stats = askedIn(world, 60).queries;
        EXPECT_GT(stats.trianglesAskedTotal, 1000u) << shape->getName();
        EXPECT_LE(100 * stats.trianglesAskedTotal, 92 * stats.trianglesTotal) << shape->getName();
    }
}

TEST(DispatcherLosses, AskOnceForEachPairOfFallingBoxesAndMakeAsManyPointsAsBullet)
{
    btBoxShape ground(vec(40, 1, 40)), box(vec(0.5, 0.5, 0.5));
    std::uint64_t points[2] = {};
    Asked asked;
    for (const Narrow narrow : {Narrow::Stock, Narrow::Dispatcher})
    {
        ConvexWorld world(narrow);
        world.add(&ground, 0, vec(0, -1, 0));
        placeFallingBoxes([&](const btVector3& at) { world.add(&box, 1, at); });
        for (int step = 0; step < 100; ++step)
        {
            world.step();
            points[narrow == Narrow::Dispatcher] += pointsOf(world.dispatcher());
            asked.pairs +=
                narrow == Narrow::Dispatcher
                    ? static_cast<std::uint64_t>(
                          world.world.getBroadphase()->getOverlappingPairCache()->getNumOverlappingPairs())
                    : 0u;
        }
        if (narrow == Narrow::Dispatcher)
            asked.queries = world.stats();
    }
    EXPECT_GT(points[0], 50000u) << "the sample has many contacts";
    EXPECT_LE(20 * points[1], 21 * points[0]);
    EXPECT_LE(queriesOf(asked.queries), asked.pairs + asked.pairs / 10);
    EXPECT_EQ(asked.queries.notConvergedTotal, 0u);
}

TEST(DispatcherLosses, GiveSolverNoMoreOfFallingBoxesWithAllOfCulletThanWithBroadphaseAlone)
{
    const FallWork own = workOfFall<World<btDiscreteDynamicsWorld>, Dispatcher>();
    const FallWork alone = workOfFall<btDiscreteDynamicsWorld, btCollisionDispatcher>();
    EXPECT_GT(alone.points, 50000u) << "the sample has many contacts";
    EXPECT_GT(alone.solvedManifolds, 10000u);
    EXPECT_LE(20 * own.points, 21 * alone.points);
    EXPECT_LE(20 * own.boxTests, 21 * alone.boxTests);
    EXPECT_LE(own.queries, own.pairs + own.pairs / 10);
    EXPECT_LE(20 * own.solvedManifolds, 21 * alone.solvedManifolds);
    EXPECT_LE(20 * own.solvedBodies, 21 * alone.solvedBodies);
    EXPECT_LE(10 * own.solverCalls, 11 * alone.solverCalls);
}

/// Bullet's algorithm of GImpact asks for each pair of triangles whose boxes overlap.
TEST(DispatcherLosses, AnswerForTrianglesOfToriWithFewDepthsAndLeaveNoneToBullet)
{
    constexpr std::uint64_t kTori = 9, kSteps = 60;
    RoughMesh mesh;
    Torus torus;
    ConvexWorld world(Narrow::Dispatcher);
    btGImpactCollisionAlgorithm::registerAlgorithm(&world.dispatcher());
    world.add(mesh.shape(), 0, vec(0, 0, 0));
    for (std::uint64_t i = 0; i < kTori; ++i)
        world.add(torus.shape(), 1, vec(3.0 * double(i % 3) - 3, 0.25, 3.0 * double(i / 3) - 3))
            .setFriction(1);
    const IsaGjkStats stats = askedIn(world, kSteps).queries;
    EXPECT_GT(stats.touchingTotal, 10000u) << "the sample has tori that lie";
    EXPECT_GT(stats.separatedTotal, 10000u);
    EXPECT_LE(queriesOf(stats), 160 * kTori * kSteps);
    EXPECT_LE(100 * stats.depthsTotal, queriesOf(stats));
    EXPECT_EQ(stats.delegatedTotal + stats.notConvergedTotal + stats.exactTotal, 0u);
}
}  // namespace cullet::test
