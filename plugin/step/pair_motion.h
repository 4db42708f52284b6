// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <cstdint>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The motion of a body without forces.
struct BodyMotion
{
    explicit BodyMotion(const btCollisionObject& object);

    /// @param time seconds since the start
    btTransform at(btScalar time) const;
    btVector3 velocityAt(const btTransform& pose, const btVector3& point) const
    {
        return linear + angular.cross(point - pose.getOrigin());
    }

    const btCollisionObject* object;
    btTransform start;
    btVector3 linear{0, 0, 0}, angular{0, 0, 0};  ///< per second; world space
    btScalar rim = 0;                             ///< the most that a point moves per second by the rotation
};

struct PairMotion
{
    BodyMotion a, b;
};

/// A point in which two moving bodies touch.
struct PairContact
{
    btVector3 localB;   ///< in the frame of b
    btVector3 normal;   ///< from b to a, world space
    btScalar distance;  ///< by which the centre of a comes nearer until then, along the normal
};

/// Finds where two bodies touch first.
///
/// @param touch    distance at which bodies touch; an approach by less in a whole step is none, so that sliding along a
///                 floor is no impact
/// @param contacts [out] gets at most 4
/// @return number of queries for closest points
unsigned findContacts(const PairMotion& pair, btCollisionWorld& world, btScalar timeStep, btScalar touch,
                      std::vector<PairContact>& contacts);
}  // namespace CULLET_PRECISION
}  // namespace cullet
