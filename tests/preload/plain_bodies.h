// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <vector>

namespace cullet::test
{
using PlainBodies = std::vector<std::unique_ptr<btRigidBody>>;

/// Adds a body to a world and to a list that keeps it.
inline void addPlainBody(btDynamicsWorld& world, PlainBodies& bodies, btCollisionShape& shape, btScalar mass,
                         const btVector3& at)
{
    btVector3 inertia(0, 0, 0);
    if (mass > 0)
        shape.calculateLocalInertia(mass, inertia);
    bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, &shape, inertia));
    // Not getIdentity(): its static variable is unique in the process, and plug-ins of both precisions would share it.
    bodies.back()->setWorldTransform(btTransform(btQuaternion(0, 0, 0, 1), at));
    bodies.back()->setInterpolationWorldTransform(bodies.back()->getWorldTransform());
    world.addRigidBody(bodies.back().get());
}
}  // namespace cullet::test
