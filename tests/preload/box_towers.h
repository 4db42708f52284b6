// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/body_hash.h"
#include "cullet/tests/preload/plain_bodies.h"

#include <btBulletDynamicsCommon.h>

#include <cstdint>
#include <cstdio>
#include <memory>
#include <vector>

namespace cullet::test
{
/// Twelve towers of three boxes and hull boxes that fall onto a plane, too far from each other to interact.
class BoxTowers
{
public:
    BoxTowers(btCollisionDispatcher& dispatcher, btBroadphaseInterface& broadphase,
              btCollisionConfiguration& configuration)
        : m_world(&dispatcher, &broadphase, &m_solver, &configuration)
    {
        for (int corner = 0; corner < 8; ++corner)
            m_hull.addPoint(btVector3(corner & 1 ? m_half : -m_half, corner & 2 ? m_half : -m_half,
                                      corner & 4 ? m_half : -m_half));
        addPlainBody(m_world, m_bodies, m_ground, 0, btVector3(0, 0, 0));
        for (int i = 0; i < 36; ++i)
            addPlainBody(m_world, m_bodies, i % 2 ? static_cast<btCollisionShape&>(m_hull) : m_box, 1,
                         btVector3(btScalar(3 * (i % 4)), btScalar(0.75 + 1.25 * (i / 12)),
                                   btScalar(3 * (i / 4 % 3))));
    }
    ~BoxTowers()
    {
        for (auto& body : m_bodies)
            m_world.removeRigidBody(body.get());
    }
    BoxTowers(const BoxTowers&) = delete;
    BoxTowers& operator=(const BoxTowers&) = delete;

    void step(int count)
    {
        for (int i = 0; i < count; ++i)
            m_world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
    }

    /// Prints the output for a test: a fingerprint of all transforms, touching pairs, the hits of a ray through each
    /// tower from above, and the height of every box.
    void print()
    {
        std::printf("hash %016llx\n", static_cast<unsigned long long>(hashOfBodies(m_bodies)));
        std::printf("touching %d\n", touching());
        std::printf("rays %d\n", raysThatHit());
        for (std::size_t i = 1; i < m_bodies.size(); ++i)
            std::printf("height %.9f\n", double(m_bodies[i]->getWorldTransform().getOrigin().y()));
        std::fflush(stdout);
    }

private:
    int touching()
    {
        int count = 0;
        for (int i = 0; i < m_world.getDispatcher()->getNumManifolds(); ++i)
            count += m_world.getDispatcher()->getManifoldByIndexInternal(i)->getNumContacts() > 0 ? 1 : 0;
        return count;
    }

    int raysThatHit()
    {
        int count = 0;
        for (int i = 0; i < 12; ++i)
        {
            const btScalar x = btScalar(3 * (i % 4)), z = btScalar(3 * (i / 4));
            btCollisionWorld::ClosestRayResultCallback ray(btVector3(x, 9, z), btVector3(x, 2, z));
            m_world.rayTest(ray.m_rayFromWorld, ray.m_rayToWorld, ray);
            count += ray.hasHit() ? 1 : 0;
        }
        return count;
    }

    const btScalar m_half = btScalar(0.5);
    btStaticPlaneShape m_ground{btVector3(0, 1, 0), 0};
    btBoxShape m_box{btVector3(m_half, m_half, m_half)};
    btConvexHullShape m_hull;
    btSequentialImpulseConstraintSolver m_solver;
    btDiscreteDynamicsWorld m_world;
    PlainBodies m_bodies;
};
}  // namespace cullet::test
