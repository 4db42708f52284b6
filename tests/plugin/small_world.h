// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <utility>
#include <vector>

namespace cullet::test
{
/// A discrete world with a given broad phase, and the bodies and shapes of a test.
class SmallWorld
{
public:
    explicit SmallWorld(btBroadphaseInterface& broadphase)
        : world(&dispatcher, &broadphase, &m_solver, &m_configuration)
    {
        world.setGravity(vec(0, -10, 0));
    }
    ~SmallWorld()
    {
        for (auto& body : m_bodies)
            world.removeRigidBody(body.get());
    }
    SmallWorld(const SmallWorld&) = delete;
    SmallWorld& operator=(const SmallWorld&) = delete;

    /// Creates a shape that lives as long as the world.
    template <class Shape, class... Arguments>
    Shape& shape(Arguments&&... arguments)
    {
        m_shapes.push_back(std::make_unique<Shape>(std::forward<Arguments>(arguments)...));
        return static_cast<Shape&>(*m_shapes.back());
    }

    /// Mass 0: static.
    btRigidBody& add(btCollisionShape& shape, double mass, const btVector3& at, int group = 0, int mask = 0)
    {
        btVector3 inertia(0, 0, 0);
        if (mass > 0)
            shape.calculateLocalInertia(btScalar(mass), inertia);
        m_bodies.push_back(std::make_unique<btRigidBody>(btScalar(mass), nullptr, &shape, inertia));
        btRigidBody& body = *m_bodies.back();
        body.setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
        body.setInterpolationWorldTransform(body.getWorldTransform());
        if (group == 0)
            world.addRigidBody(&body);
        else
            world.addRigidBody(&body, group, mask);
        return body;
    }

    void step(int count = 1)
    {
        for (int i = 0; i < count; ++i)
            world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
    }

private:
    btDefaultCollisionConfiguration m_configuration;
    btSequentialImpulseConstraintSolver m_solver;

public:
    btCollisionDispatcher dispatcher{&m_configuration};
    btDiscreteDynamicsWorld world;

private:
    std::vector<std::unique_ptr<btCollisionShape>> m_shapes;
    std::vector<std::unique_ptr<btRigidBody>> m_bodies;
};

inline double heightOf(const btCollisionObject& body)
{
    return double(body.getWorldTransform().getOrigin().y());
}

/// Expects the same numbers with cullet and with Bullet's own broad phase, within a tolerance.
///
/// @param scene takes a btBroadphaseInterface& and returns a std::vector<double>
template <class Scene>
void expectAsWithDbvt(const Scene& scene, double tolerance)
{
    Broadphase own;
    btDbvtBroadphase stock;
    const std::vector<double> values = scene(own), expected = scene(stock);
    ASSERT_EQ(values.size(), expected.size());
    for (std::size_t i = 0; i < values.size(); ++i)
        EXPECT_NEAR(values[i], expected[i], tolerance) << "number " << i;
}
}  // namespace cullet::test
