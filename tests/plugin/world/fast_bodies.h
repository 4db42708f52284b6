// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/world.h"
#include "cullet/tests/plugin/convex/convex_world.h"

#include <ostream>
#include <random>
#include <utility>

namespace cullet::test
{
/// What of a world is cullet's.
enum class Own
{
    Nothing,
    Broadphase,
    Dispatcher,
    BroadphaseAndWorld,
    All
};

inline void PrintTo(Own own, std::ostream* out)
{
    constexpr const char* kNames[] = {"Nothing", "Broadphase", "Dispatcher", "BroadphaseAndWorld", "All"};
    *out << kNames[static_cast<int>(own)];
}

/// What keeps fast bodies from tunnelling.
enum class Continuous
{
    Nothing,
    BulletsSweeps,  ///< CCD thresholds and swept spheres
    Speculation     ///< of cullet::World
};

/// What a body is fired at, each in a lane of its own.
enum class Target
{
    Wall,  ///< a thin box
    Hull,
    Mesh,
    Compound
};
inline constexpr Target kTargets[] = {Target::Wall, Target::Hull, Target::Mesh, Target::Compound};

/// Bodies that fly along x at thin targets in x = 0, without gravity and air.
class FastBodies
{
public:
    static constexpr double kStart = -6, kLane = 4, kHalfTarget = 1.2, kHalfThickness = 0.03, kRadius = 0.1;

    explicit FastBodies(Own own, btScalar speculation = 0)
    {
        const bool hasBroadphase = own != Own::Nothing && own != Own::Dispatcher;
        if (own == Own::Dispatcher || own == Own::All)
            m_dispatcher = std::make_unique<Dispatcher>(&m_configuration);
        else
            m_dispatcher = std::make_unique<btCollisionDispatcher>(&m_configuration);
        if (hasBroadphase)
            m_broadphase = std::make_unique<Broadphase>();
        else
            m_broadphase = std::make_unique<btDbvtBroadphase>();
        makeWorld(own == Own::BroadphaseAndWorld || own == Own::All, speculation);
        world->setGravity(btVector3(0, 0, 0));
        for (int i = 0; i < 4; ++i)
        {
            const double y = (i & 1) != 0 ? 0.6 : -0.6, z = (i & 2) != 0 ? 0.6 : -0.6;
            m_wallOfParts.addChildShape(btTransform(btQuaternion::getIdentity(), vec(0, y, z)), &m_part);
        }
        m_dumbbell.addChildShape(at(0.05, 0.06, 0), &m_box);
        m_dumbbell.addChildShape(at(-0.05, -0.06, 0), &m_ball);
        addTriangles();
        m_mesh = std::make_unique<btBvhTriangleMeshShape>(&m_triangles, true);
    }
    ~FastBodies()
    {
        for (const auto& body : bodies)
            world->removeRigidBody(body.get());
        for (const auto& target : m_targets)
            world->removeRigidBody(target.get());
    }
    FastBodies(const FastBodies&) = delete;
    FastBodies& operator=(const FastBodies&) = delete;

    /// @param shape  0 to 3, or 4: a compound, which Bullet does not sweep
    /// @param speed  metres per second
    /// @param aside  of the middle of the target, along y and z; beyond kHalfTarget the body flies past
    void fire(Target target, int shape, double speed, std::pair<double, double> aside, Continuous continuous,
              const btQuaternion& rotation)
    {
        const double lane = kLane * double(bodies.size());
        m_targets.push_back(makeBodyAt(at(0, 0, lane), shapeOf(target), 0));
        world->addRigidBody(m_targets.back().get());
        btTransform start = at(kStart, aside.first, lane + aside.second);
        start.setRotation(rotation);
        bodies.push_back(makeBodyAt(start, projectile(shape), 1));
        btRigidBody& body = *bodies.back();
        body.setLinearVelocity(vec(speed, 0, 0));
        body.setActivationState(DISABLE_DEACTIVATION);
        if (continuous == Continuous::BulletsSweeps)
        {
            body.setCcdMotionThreshold(btScalar(0.5 * kRadius));
            body.setCcdSweptSphereRadius(btScalar(0.8 * kRadius));
        }
        world->addRigidBody(&body);
    }
    /// Until the slowest would have flown past its target.
    void fly(double slowest)
    {
        const int steps = int(60 * (1 - kStart) / slowest) + 10;
        for (int i = 0; i < steps; ++i)
            world->stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
    }
    bool hasPassed(std::size_t i) const
    {
        return double(bodies[i]->getWorldTransform().getOrigin().x()) > 3 * kRadius;
    }
    /// Whether something has changed the velocity of a body, which was `speed` along x.
    bool isDeflected(std::size_t i, double speed) const
    {
        return double((bodies[i]->getLinearVelocity() - vec(speed, 0, 0)).length()) > 1e-3 * speed;
    }
    std::vector<bool> passed() const
    {
        std::vector<bool> all;
        for (std::size_t i = 0; i < bodies.size(); ++i)
            all.push_back(hasPassed(i));
        return all;
    }

    std::unique_ptr<btDiscreteDynamicsWorld> world;
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    World<btDiscreteDynamicsWorld>* ownWorld = nullptr;

private:
    static btTransform at(double x, double y, double z)
    {
        return btTransform(btQuaternion::getIdentity(), vec(x, y, z));
    }
    void makeWorld(bool isOwn, btScalar speculation)
    {
        if (!isOwn)
        {
            world = std::make_unique<btDiscreteDynamicsWorld>(m_dispatcher.get(), m_broadphase.get(),
                                                              &m_solver, &m_configuration);
            return;
        }
        auto made = std::make_unique<World<btDiscreteDynamicsWorld>>(m_dispatcher.get(), m_broadphase.get(),
                                                                     &m_solver, &m_configuration);
        made->setSpeculation(speculation);
        ownWorld = made.get();
        world = std::move(made);
    }
    btCollisionShape* shapeOf(Target target)
    {
        switch (target)
        {
            case Target::Wall:
                return &m_wall;
            case Target::Hull:
                return m_hull.get();
            case Target::Mesh:
                return m_mesh.get();
            default:
                return &m_wallOfParts;
        }
    }
    btCollisionShape* projectile(int i)
    {
        btCollisionShape* const all[] = {&m_ball, &m_box, m_crystal.get(), &m_capsule, &m_dumbbell};
        return all[i];
    }
    void addTriangles()
    {
        constexpr double h = kHalfTarget;
        m_triangles.addTriangle(vec(0, -h, -h), vec(0, h, -h), vec(0, -h, h));
        m_triangles.addTriangle(vec(0, h, -h), vec(0, h, h), vec(0, -h, h));
    }

    btBoxShape m_wall{vec(kHalfThickness, kHalfTarget, kHalfTarget)}, m_part{vec(kHalfThickness, 0.6, 0.6)};
    std::unique_ptr<btConvexHullShape> m_hull =
        makeHullShape(boxPoints(kHalfThickness, kHalfTarget, kHalfTarget));
    btCompoundShape m_wallOfParts;
    btCompoundShape m_dumbbell;
    btTriangleMesh m_triangles;
    std::unique_ptr<btBvhTriangleMeshShape> m_mesh;
    btSphereShape m_ball{btScalar(kRadius)};
    btBoxShape m_box{vec(kRadius, kRadius, kRadius)};
    std::unique_ptr<btConvexHullShape> m_crystal = makeHullShape(ballPoints(20, kRadius, 3));
    btCapsuleShape m_capsule{btScalar(0.7 * kRadius), btScalar(kRadius)};
    btDefaultCollisionConfiguration m_configuration;
    btSequentialImpulseConstraintSolver m_solver;
    std::unique_ptr<btCollisionDispatcher> m_dispatcher;
    std::unique_ptr<btBroadphaseInterface> m_broadphase;
    std::vector<std::unique_ptr<btRigidBody>> m_targets;
};
}  // namespace cullet::test
