// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/body_hash.h"
#include "cullet/tests/preload/plain_bodies.h"

#include <btBulletDynamicsCommon.h>

#include <cstdio>
#include <memory>
#include <typeinfo>
#include <vector>

namespace cullet::test
{
/// Leaning towers of boxes, and chains of boxes that hang from joints of several kinds and touch the
/// ground.
class SolverScene
{
public:
    SolverScene(btDynamicsWorld& world, int towers) : m_world(world)
    {
        m_world.setGravity(btVector3(0, -10, 0));
        addPlainBody(m_world, m_bodies, m_ground, 0, btVector3(0, 0, 0));
        for (int i = 0; i < 4 * towers; ++i)
            addPlainBody(m_world, m_bodies, m_box, 1,
                         btVector3(btScalar(2 * (i / 4 % 20)) + btScalar(0.1 * (i % 3)),
                                   btScalar(0.75 + 1.25 * (i % 4)), btScalar(2 * (i / 80))));
        for (int chain = 0; chain < 6; ++chain)
            addChain(btVector3(btScalar(3 * chain), 6, -4), chain);
    }
    ~SolverScene()
    {
        for (auto& joint : m_joints)
            m_world.removeConstraint(joint.get());
        for (auto& body : m_bodies)
            m_world.removeCollisionObject(body.get());
    }
    SolverScene(const SolverScene&) = delete;
    SolverScene& operator=(const SolverScene&) = delete;

    void step(int count)
    {
        for (int i = 0; i < count; ++i)
            m_world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
    }

    /// Prints the output for a test: a fingerprint of all transforms, and what the program sees of its solver.
    void print(btConstraintSolver& solver)
    {
        double impulses = 0;
        for (auto& joint : m_joints)
            impulses += double(joint->getAppliedImpulse());
        std::printf("hash %016llx\n", static_cast<unsigned long long>(hashOfBodies(m_bodies)));
        std::printf("impulses %.17g\n", impulses);
        std::printf("type %s\n", typeid(solver).name());
        std::printf("kind %d %d\n", static_cast<int>(solver.getSolverType()),
                    dynamic_cast<btSequentialImpulseConstraintSolver*>(&solver) != nullptr);
        std::fflush(stdout);
    }

private:
    void addChain(const btVector3& top, int kind)
    {
        addPlainBody(m_world, m_bodies, m_box, 0, top);
        for (int i = 1; i <= 5; ++i)
        {
            addPlainBody(m_world, m_bodies, m_box, 1, top + btVector3(btScalar(0.2), btScalar(-1.3 * i), 0));
            btRigidBody& above = *m_bodies[m_bodies.size() - 2];
            btRigidBody& below = *m_bodies.back();
            m_joints.push_back(joint(kind, above, below));
            m_world.addConstraint(m_joints.back().get(), true);
        }
    }

    std::unique_ptr<btTypedConstraint> joint(int kind, btRigidBody& a, btRigidBody& b) const
    {
        const btVector3 under(0, btScalar(-0.65), 0), over(0, btScalar(0.65), 0), axis(0, 0, 1);
        const btQuaternion straight(0, 0, 0, 1);
        const btTransform inA(straight, under), inB(straight, over);
        if (kind % 3 == 0)
            return std::make_unique<btPoint2PointConstraint>(a, b, under, over);
        if (kind % 3 == 1)
        {
            auto hinge = std::make_unique<btHingeConstraint>(a, b, under, over, axis, axis);
            hinge->enableAngularMotor(true, 1, btScalar(0.1));
            return hinge;
        }
        return std::make_unique<btGeneric6DofSpring2Constraint>(a, b, inA, inB);
    }

    btDynamicsWorld& m_world;
    btStaticPlaneShape m_ground{btVector3(0, 1, 0), 0};
    btBoxShape m_box{btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5))};
    PlainBodies m_bodies;
    std::vector<std::unique_ptr<btTypedConstraint>> m_joints;
};

inline void runScene(btDynamicsWorld& world, int towers)
{
    SolverScene scene(world, towers);
    scene.step(60);
    scene.print(*world.getConstraintSolver());
}

/// What a world needs but a solver.
struct SolverWorldParts
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
};
}  // namespace cullet::test
