// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/convex/convex_world.h"
#include "cullet/tests/plugin/mesh/mesh_bench.h"

#include <BulletCollision/CollisionDispatch/btInternalEdgeUtility.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

namespace cullet::test
{
namespace
{
IsaGjkOptions withActiveEdges()
{
    IsaGjkOptions options;
    options.activeEdges = true;
    return options;
}

/// A level square of 10 m of triangles of half a metre.
struct MeshEdges : testing::Test
{
    MeshEdges()
    {
        const auto corner = [](int i, int j) { return vec(0.5 * i - 5, 0, 0.5 * j - 5); };
        for (int i = 0; i < 20; ++i)
        {
            for (int j = 0; j < 20; ++j)
            {
                triangles.addTriangle(corner(i, j), corner(i, j + 1), corner(i + 1, j));
                triangles.addTriangle(corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1));
            }
        }
        shape = std::make_unique<btBvhTriangleMeshShape>(&triangles, true);
        bodies.push_back(std::make_unique<btSphereShape>(btScalar(0.5)));
        bodies.push_back(std::make_unique<btBoxShape>(vec(0.5, 0.5, 0.5)));
        bodies.push_back(std::make_unique<btCapsuleShapeX>(btScalar(0.5), btScalar(0.8)));
        auto hull = std::make_unique<btConvexHullShape>();
        std::uniform_real_distribution<double> place(-1, 1);
        for (int i = 0; i < 64; ++i)
            hull->addPoint(drawVec(place, engine).normalized() * btScalar(0.5), false);
        hull->recalcLocalAabb();
        bodies.push_back(std::move(hull));
        // Bullet's algorithm finds their points.
        bodies.push_back(std::make_unique<btCylinderShape>(vec(0.5, 0.5, 0.5)));
        bodies.push_back(std::make_unique<btConeShape>(btScalar(0.5), btScalar(1)));
    }

    std::mt19937 engine{11};
    btTriangleMesh triangles;
    std::unique_ptr<btBvhTriangleMeshShape> shape;
    std::vector<std::unique_ptr<btConvexShape>> bodies;
};

TEST_F(MeshEdges, GiveNormalsOfFlatMeshOnlyWhenTheyAreCorrected)
{
    std::uniform_real_distribution<double> place(-3, 3), low(0.46, 0.54), turn(-3, 3);
    bool isTiltedWithout = false;
    for (const auto& body : bodies)
    {
        MeshBench corrected(Loop::Ours, *body, *shape, false, withActiveEdges());
        MeshBench plain(Loop::Ours, *body, *shape);
        int tilted = 0, corners = 0, points = 0;
        for (int i = 0; i < 400; ++i)
        {
            const double x = place(engine), y = low(engine), z = place(engine), angle = turn(engine);
            const btTransform at(btQuaternion(vec(0, 1, 0), btScalar(angle)), vec(x, y, z));
            const btPersistentManifold& with = corrected.stepFromNothing(at, btTransform::getIdentity());
            const btPersistentManifold& without = plain.stepFromNothing(at, btTransform::getIdentity());
            EXPECT_EQ(with.getNumContacts() > 0, without.getNumContacts() > 0);
            for (int k = 0; k < with.getNumContacts(); ++k)
                tilted += with.getContactPoint(k).m_normalWorldOnB.y() < btScalar(0.9999);
            for (int k = 0; k < without.getNumContacts(); ++k)
                corners += without.getContactPoint(k).m_normalWorldOnB.y() < btScalar(0.9999);
            points += with.getNumContacts();
        }
        EXPECT_GT(points, 100) << body->getName();
        EXPECT_EQ(tilted, 0) << body->getName();
        isTiltedWithout = isTiltedWithout || corners > 100;
    }
    EXPECT_TRUE(isTiltedWithout);
}

/// Names all triangles alike.
struct Nameless final : btConcaveShape
{
    explicit Nameless(const btConcaveShape& named) : m_named(named)
    {
        m_shapeType = FAST_CONCAVE_MESH_PROXYTYPE;
    }
    void processAllTriangles(btTriangleCallback* callback, const btVector3& low,
                             const btVector3& high) const override
    {
        struct Rename : btTriangleCallback
        {
            void processTriangle(btVector3* corners, int, int) override
            {
                callback->processTriangle(corners, 0, 0);
            }
            btTriangleCallback* callback;
        } rename;
        rename.callback = callback;
        m_named.processAllTriangles(&rename, low, high);
    }
    void getAabb(const btTransform& at, btVector3& low, btVector3& high) const override
    {
        m_named.getAabb(at, low, high);
    }
    void setLocalScaling(const btVector3&) override {}
    const btVector3& getLocalScaling() const override { return m_named.getLocalScaling(); }
    void calculateLocalInertia(btScalar, btVector3& inertia) const override { inertia.setZero(); }
    const char* getName() const override { return "Nameless"; }

    const btConcaveShape& m_named;
};

TEST_F(MeshEdges, AreCorrectedWhereAllTrianglesHaveOneName)
{
    Nameless nameless(*shape);
    nameless.setMargin(shape->getMargin());
    std::uniform_real_distribution<double> place(-3, 3);
    int points = 0;
    for (const auto& body : bodies)
    {
        MeshBench named(Loop::Ours, *body, *shape, false, withActiveEdges());
        MeshBench other(Loop::Ours, *body, nameless, false, withActiveEdges());
        for (int i = 0; i < 100; ++i)
        {
            const double x = place(engine), z = place(engine);
            const btTransform at(btQuaternion::getIdentity(), vec(x, 0.49, z));
            const btPersistentManifold& right = named.stepFromNothing(at, btTransform::getIdentity());
            const btPersistentManifold& found = other.stepFromNothing(at, btTransform::getIdentity());
            ASSERT_EQ(found.getNumContacts(), right.getNumContacts());
            for (int k = 0; k < found.getNumContacts(); ++k)
                EXPECT_EQ(found.getContactPoint(k).m_distance1, right.getContactPoint(k).m_distance1);
            points += found.getNumContacts();
        }
    }
    EXPECT_GT(points, 200);
}

TEST_F(MeshEdges, AreLeftToBulletsUtilityWhereTheApplicationUsesIt)
{
    btTriangleInfoMap map;
    btGenerateInternalEdgeInfo(shape.get(), &map);
    MeshBench corrected(Loop::Ours, *bodies[0], *shape, false, withActiveEdges());
    MeshBench plain(Loop::Ours, *bodies[0], *shape);
    std::uniform_real_distribution<double> place(-3, 3);
    int points = 0;
    for (int i = 0; i < 100; ++i)
    {
        const double x = place(engine), z = place(engine);
        const btTransform at(btQuaternion::getIdentity(), vec(x, 0.49, z));
        const btPersistentManifold& with = corrected.stepFromNothing(at, btTransform::getIdentity());
        EXPECT_TRUE(arePointsEqual(with, plain.stepFromNothing(at, btTransform::getIdentity())));
        points += with.getNumContacts();
    }
    EXPECT_GT(points, 150);
    shape->setTriangleInfoMap(nullptr);
}

/// The largest vertical speed of a body that slides without friction for two seconds.
double largestJump(btConvexShape& body, btCollisionShape& ground, bool isCorrected)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    IsaGjkOptions options;
    options.activeEdges = isCorrected;
    registerIsaGjk(dispatcher, options);
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
    world.setGravity(vec(0, -10, 0));
    btRigidBody floor(0, nullptr, &ground);
    world.addRigidBody(&floor);
    btVector3 inertia;
    body.calculateLocalInertia(1, inertia);
    btRigidBody slider(1, nullptr, &body, inertia);
    slider.setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(-4.1, 0.545, 0.13)));
    slider.setFriction(0);
    slider.setAngularFactor(btScalar(0));
    slider.setActivationState(DISABLE_DEACTIVATION);
    world.addRigidBody(&slider);
    for (int i = 0; i < 30; ++i)
        world.stepSimulation(btScalar(1) / 60, 0);
    slider.setLinearVelocity(vec(8, 0, 0.7));
    double largest = 0;
    for (int i = 0; i < 60; ++i)
    {
        world.stepSimulation(btScalar(1) / 60, 0);
        largest = std::max(largest, double(slider.getLinearVelocity().y()));
    }
    EXPECT_GT(slider.getWorldTransform().getOrigin().x(), 1);
    world.removeRigidBody(&slider);
    world.removeRigidBody(&floor);
    return largest;
}

TEST_F(MeshEdges, DoNotMakeSlidingBodiesJumpWhenTheyAreCorrected)
{
    for (const auto& body : bodies)
        EXPECT_LT(largestJump(*body, *shape, true), 0.1) << body->getName();
    // The sample can show it: without the correction a body jumps.
    double largest = 0;
    for (const auto& body : bodies)
        largest = std::max(largest, largestJump(*body, *shape, false));
    EXPECT_GT(largest, 0.15);
}
}  // namespace
}  // namespace cullet::test
