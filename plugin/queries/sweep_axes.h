// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/queries/mesh_sweep.h"

#include <BulletCollision/CollisionShapes/btConvexShape.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The motion in the frame of the object with the mesh.
struct LocalMotion
{
    LocalMotion(const ConvexSweep& sweep, const btTransform& meshAt)
    {
        const btTransform toMesh = meshAt.inverse();
        from = toMesh * sweep.from->getOrigin();
        to = toMesh * sweep.to->getOrigin();
        basis = toMesh.getBasis() * sweep.to->getBasis();
        sweep.shape->getAabb(btTransform(basis), boxMin, boxMax);
        turns = !(sweep.from->getBasis() == sweep.to->getBasis());
    }

    btVector3 from, to;
    btMatrix3x3 basis;         ///< orientation at the end
    btVector3 boxMin, boxMax;  ///< Bullet's box about the shape's origin, with that orientation
    bool turns;
};

/// Axes along which a shape that does not turn approaches a triangle. A gap along an axis changes linearly while the shape
/// moves, and as long as there is one, the shape does not touch the triangle.
class SweepAxes
{
public:
    /// @param reach gaps below this do not count
    SweepAxes(const ConvexSweep& sweep, const LocalMotion& motion, btScalar reach)
        : m_shape(*sweep.shape), m_motion(motion), m_reach(reach)
    {
    }

    /// A fraction of the motion before which the shape surely is out of reach of a triangle; 0 if it turns.
    ///
    /// @param until no better bound is sought than this
    btScalar earliest(const btVector3* corners, btScalar until) const;

private:
    static constexpr int kMostAxes = 4;
    static constexpr btScalar kNever = 2;

    btScalar reachedAt(const btVector3& axis, const btVector3* corners, btScalar until,
                       btVector3& nearest) const;

    const btConvexShape& m_shape;
    const LocalMotion& m_motion;
    btScalar m_reach;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
