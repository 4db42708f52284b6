// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/hull_pairs.h"

#include <BulletCollision/CollisionShapes/btConvexHullShape.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
inline btTransform transformOf(const Pose<btScalar>& pose)
{
    const auto& m = pose.basis;
    return btTransform(
        btMatrix3x3(m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)),
        btVector3(pose.origin.x(), pose.origin.y(), pose.origin.z()));
}

/// Gives an empty shape the vertices of a hull and no margin, so that all libraries have the same shape.
inline void fillShape(const Hull<btScalar>& hull, btConvexHullShape& shape)
{
    for (int v = 0; v < hull.vertexCount(); ++v)
        shape.addPoint(btVector3(hull.vertex(v).x(), hull.vertex(v).y(), hull.vertex(v).z()), false);
    shape.recalcLocalAabb();
    shape.setMargin(btScalar(0));
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
