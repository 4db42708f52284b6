// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionShapes/btConvexHullShape.h>

#include <memory>
#include <vector>

class btConvexTriangleMeshShape;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A hull shape with the vertices of a btConvexTriangleMeshShape, which has no vertices but a support function that reads
/// all triangles. The triangles are read in every call, so that edits of any kind are seen at once.
class ConvexMeshHull
{
public:
    /// Whether a shape is exactly Bullet's, with arrays whose reading calls nothing of the application.
    static bool isPossible(const btCollisionShape& shape);

    /// @pre isPossible()
    /// @return valid until the next call; null if there are no triangles, one is not finite, or out of memory
    const btConvexHullShape* hullOf(const btConvexTriangleMeshShape& shape);

private:
    void readCorners(const btConvexTriangleMeshShape& shape);
    bool areFinite() const;
    bool hasChanged() const;
    void makeHull();

    std::vector<btVector3> m_corners, m_lastCorners;  ///< of all triangles
    std::unique_ptr<btConvexHullShape> m_hull;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
