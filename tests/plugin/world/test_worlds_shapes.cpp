// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Non-convex shapes as ground and as falling bodies, in dynamic worlds and in a collision world; and multibodies with
// joints.

#include "cullet/tests/plugin/small_world.h"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr int kSide = 33;

/// Height of the ground at a corner of the grid, which is centred at the origin with a metre between corners.
double groundHeight(int x, int z)
{
    return 0.25 * std::sin(0.5 * x) + 0.25 * std::cos(0.4 * z);
}

/// One gentle ground as a triangle mesh and as a heightfield, and a flat one as a compound of tiles.
struct Grounds
{
    Grounds()
    {
        const auto corner = [](int x, int z)
        { return vec(x - kSide / 2, groundHeight(x, z), z - kSide / 2); };
        for (int z = 0; z + 1 < kSide; ++z)
        {
            for (int x = 0; x + 1 < kSide; ++x)
            {
                triangles.addTriangle(corner(x, z), corner(x, z + 1), corner(x + 1, z));
                triangles.addTriangle(corner(x + 1, z), corner(x, z + 1), corner(x + 1, z + 1));
            }
        }
        for (int z = -2; z <= 2; ++z)
        {
            for (int x = -2; x <= 2; ++x)
                tiles.addChildShape(btTransform(btQuaternion::getIdentity(), vec(6 * x, -0.5, 6 * z)), &tile);
        }
        mesh = std::make_unique<btBvhTriangleMeshShape>(&triangles, true);
    }

    static std::vector<btScalar> heights()
    {
        std::vector<btScalar> result;  // PHY_FLOAT means btScalar
        for (int z = 0; z < kSide; ++z)
        {
            for (int x = 0; x < kSide; ++x)
                result.push_back(btScalar(groundHeight(x, z)));
        }
        return result;
    }

    std::vector<btCollisionShape*> all() { return {mesh.get(), &field, &tiles}; }

    btTriangleMesh triangles;
    std::unique_ptr<btBvhTriangleMeshShape> mesh;
    std::vector<btScalar> samples = heights();
    btHeightfieldTerrainShape field{kSide,         kSide, samples.data(), 1,    btScalar(-0.5),
                                    btScalar(0.5), 1,     PHY_FLOAT,      false};
    btBoxShape tile{vec(3, 0.5, 3)};
    btCompoundShape tiles;
};

/// A dumb-bell, an angle of two boxes, and a compound of the two.
struct Compounds
{
    Compounds()
    {
        const auto at = [](double x, double y, double z)
        { return btTransform(btQuaternion::getIdentity(), vec(x, y, z)); };
        dumbbell.addChildShape(at(-0.5, 0, 0), &ball);
        dumbbell.addChildShape(at(0.5, 0, 0), &ball);
        angle.addChildShape(at(0, 0, 0), &bar);
        angle.addChildShape(at(0.5, 0.25, 0), &block);
        both.addChildShape(at(0, 0, 0), &angle);
        both.addChildShape(at(0, 0.5, 0), &dumbbell);
    }
    btSphereShape ball{btScalar(0.3)};
    btBoxShape bar{vec(0.6, 0.1, 0.3)};
    btBoxShape block{vec(0.1, 0.3, 0.3)};
    btCompoundShape dumbbell, angle, both;
};

/// Heights of nine bodies that have fallen onto a ground, far from each other.
std::vector<double> dropOnto(btCollisionShape& ground, btBroadphaseInterface& broadphase)
{
    Compounds compounds;
    SmallWorld scene(broadphase);
    scene.add(ground, 0, vec(0, 0, 0));
    btConvexHullShape& hull = scene.shape<btConvexHullShape>();
    for (int i = 0; i < 12; ++i)
        hull.addPoint(vec(0.4 * std::cos(i), 0.3 * std::sin(2.4 * i), 0.4 * std::sin(i)));
    btCollisionShape* shapes[] = {&compounds.dumbbell,
                                  &compounds.angle,
                                  &compounds.both,
                                  &hull,
                                  &scene.shape<btBoxShape>(vec(0.4, 0.3, 0.2)),
                                  &scene.shape<btCylinderShape>(vec(0.3, 0.3, 0.3)),
                                  &scene.shape<btCapsuleShape>(btScalar(0.2), btScalar(0.6)),
                                  &scene.shape<btConeShape>(btScalar(0.3), btScalar(0.6)),
                                  &scene.shape<btSphereShape>(btScalar(0.3))};
    std::vector<btRigidBody*> bodies;
    for (int i = 0; i < 9; ++i)
    {
        bodies.push_back(&scene.add(*shapes[i], 1, vec(5 * (i % 3) - 5, 1.5, 5 * (i / 3) - 5)));
        bodies.back()->setDamping(btScalar(0.2), btScalar(0.9));  // so that rolling bodies stay near
    }
    scene.step(100);
    std::vector<double> heights;
    for (const btRigidBody* body : bodies)
    {
        heights.push_back(heightOf(*body));
        EXPECT_GT(heights.back(), -0.5)
            << "fell through the ground: " << body->getCollisionShape()->getName();
        EXPECT_LT(heights.back(), 1.4) << "has not fallen";
    }
    return heights;
}

TEST(WorldsShapes, MatchDbvtWhenTheyLandOnMeshHeightfieldOrCompound)
{
    Grounds grounds;
    for (btCollisionShape* ground : grounds.all())
    {
        SCOPED_TRACE(ground->getName());
        // The bodies do not meet, but the solver processes their contacts in the order of the pairs.
        expectAsWithDbvt([&](btBroadphaseInterface& broadphase) { return dropOnto(*ground, broadphase); },
                         0.05);
    }
}

/// Height of a tetrahedron mesh that moves, on a plane.
std::vector<double> dropMovingMesh(btBroadphaseInterface& broadphase)
{
    SmallWorld scene(broadphase);
    btGImpactCollisionAlgorithm::registerAlgorithm(&scene.dispatcher);
    btTriangleMesh triangles;
    const btVector3 corners[] = {vec(0.5, -0.3, 0), vec(-0.3, -0.3, 0.4), vec(-0.3, -0.3, -0.4),
                                 vec(0, 0.6, 0)};
    for (const auto& face : {std::array<int, 3>{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}})
        triangles.addTriangle(corners[face[0]], corners[face[1]], corners[face[2]]);
    btGImpactMeshShape& shape = scene.shape<btGImpactMeshShape>(&triangles);
    shape.updateBound();
    scene.add(scene.shape<btBoxShape>(vec(5, 1, 5)), 0, vec(0, -1, 0));
    btRigidBody& body = scene.add(shape, 1, vec(0, 1, 0));
    scene.step(120);
    EXPECT_NEAR(heightOf(body), 0.3, 0.1);
    return {heightOf(body)};
}

TEST(WorldsShapes, MatchDbvtWhenMovingMeshLands)
{
    expectAsWithDbvt(dropMovingMesh, 1e-3);
}

struct ContactCount final : btCollisionWorld::ContactResultCallback
{
    btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                             const btCollisionObjectWrapper*, int, int) override
    {
        ++count;
        deepest = std::min(deepest, double(point.getDistance()));
        return 0;
    }
    int count = 0;
    double deepest = 0;
};

/// Results of a world without dynamics for a probe over every ground.
std::vector<double> askTheGround(btCollisionShape& ground, btBroadphaseInterface& broadphase)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btCollisionWorld world(&dispatcher, &broadphase, &configuration);
    btCollisionObject floor, probe;
    floor.setCollisionShape(&ground);
    btSphereShape ball(1);
    probe.setCollisionShape(&ball);
    world.addCollisionObject(&floor);
    world.addCollisionObject(&probe);
    std::vector<double> answers;
    int contacts = 0;
    for (int i = 0; i < 40; ++i)
    {
        const btVector3 at = vec(0.3 * i - 6, 0.8, 5 - 0.25 * i);
        probe.getWorldTransform().setOrigin(at);
        world.updateSingleAabb(&probe);
        ContactCount touching, pair;
        world.contactTest(&probe, touching);
        world.contactPairTest(&probe, &floor, pair);
        btCollisionWorld::ClosestRayResultCallback ray(at + vec(0.2, 9, 0), at - vec(0, 9, 0.1));
        world.rayTest(ray.m_rayFromWorld, ray.m_rayToWorld, ray);
        btCollisionWorld::ClosestConvexResultCallback sweep(at + vec(4, 5, 0), at + vec(4, -5, 0));
        world.convexSweepTest(&ball, btTransform(btQuaternion::getIdentity(), sweep.m_convexFromWorld),
                              btTransform(btQuaternion::getIdentity(), sweep.m_convexToWorld), sweep);
        for (const double answer : {double(touching.count), touching.deepest, double(pair.count),
                                    double(ray.m_closestHitFraction), double(sweep.m_closestHitFraction)})
            answers.push_back(answer);
        EXPECT_TRUE(ray.hasHit());
        EXPECT_TRUE(sweep.hasHit());
        contacts += touching.count;
    }
    EXPECT_GT(contacts, 20);
    world.removeCollisionObject(&floor);
    world.removeCollisionObject(&probe);
    return answers;
}

TEST(WorldsShapes, MatchDbvtExactlyInQueriesOfCollisionWorld)
{
    Grounds grounds;
    for (btCollisionShape* ground : grounds.all())
    {
        SCOPED_TRACE(ground->getName());
        expectAsWithDbvt([&](btBroadphaseInterface& broadphase) { return askTheGround(*ground, broadphase); },
                         0.0);
    }
}

/// A chain of five links that swings from a fixed base into a wall.
class Chain
{
public:
    static constexpr int kLinks = 5;

    explicit Chain(btMultiBodyDynamicsWorld& world) : m_world(world)
    {
        m_body.setBasePos(vec(0, 6, 0));
        for (int i = 0; i < kLinks; ++i)
            m_body.setupRevolute(i, 1, vec(0.1, 0.1, 0.1), i - 1, btQuaternion::getIdentity(), vec(0, 0, 1),
                                 vec(i == 0 ? 0 : 0.5, 0, 0), vec(0.5, 0, 0), true);
        m_body.finalizeMultiDof();
        world.addMultiBody(&m_body);
        for (int i = 0; i < kLinks; ++i)
        {
            colliders.push_back(std::make_unique<btMultiBodyLinkCollider>(&m_body, i));
            colliders.back()->setCollisionShape(&m_shape);
            world.addCollisionObject(colliders.back().get(), btBroadphaseProxy::DefaultFilter,
                                     btBroadphaseProxy::AllFilter);
            m_body.getLink(i).m_collider = colliders.back().get();
        }
        btAlignedObjectArray<btQuaternion> rotations;
        btAlignedObjectArray<btVector3> origins;
        m_body.forwardKinematics(rotations, origins);
        m_body.updateCollisionObjectWorldTransforms(rotations, origins);
    }
    ~Chain()
    {
        for (auto& collider : colliders)
            m_world.removeCollisionObject(collider.get());
        m_world.removeMultiBody(&m_body);
    }
    Chain(const Chain&) = delete;
    Chain& operator=(const Chain&) = delete;

    std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders;

private:
    btMultiBodyDynamicsWorld& m_world;
    btBoxShape m_shape{vec(0.45, 0.1, 0.1)};
    btMultiBody m_body{kLinks, 0, vec(0, 0, 0), true, false};
};

std::vector<double> swingIntoAWall(btBroadphaseInterface& broadphase)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btMultiBodyConstraintSolver solver;
    btMultiBodyDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
    world.setGravity(vec(0, -10, 0));
    btBoxShape wallShape(vec(1, 5, 2));
    btRigidBody wall(0, nullptr, &wallShape);
    wall.setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(-1.5, 3, 0)));
    world.addRigidBody(&wall);
    std::vector<double> result;
    int stepsInContact = 0;
    {
        Chain chain(world);
        for (int i = 0; i < 100; ++i)
        {
            world.stepSimulation(btScalar(1) / 60, 0);
            for (int m = 0; m < dispatcher.getNumManifolds(); ++m)
                stepsInContact += dispatcher.getManifoldByIndexInternal(m)->getNumContacts() > 0 ? 1 : 0;
        }
        for (const auto& collider : chain.colliders)
        {
            const btVector3 at = collider->getWorldTransform().getOrigin();
            EXPECT_GT(at.x(), btScalar(-0.6)) << "a link is in the wall";
            result.push_back(double(at.x()));
            result.push_back(double(at.y()));
        }
    }
    EXPECT_GT(stepsInContact, 3) << "the chain has not met the wall";
    world.removeRigidBody(&wall);
    return result;
}

TEST(WorldsShapes, MatchDbvtWhenChainOfMultibodyLinksHitsWall)
{
    // Several links touch at once, and the solver processes them in the order of the pairs.
    expectAsWithDbvt(swingIntoAWall, 0.05);
}
}  // namespace
}  // namespace cullet::test
