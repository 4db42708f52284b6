// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionShapes/btConcaveShape.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Calls back for each triangle of a concave shape that btConcaveShape::processAllTriangles() reports for a box, with the
/// same vertices, part and index, in the same order.
///
/// For a shape that is exactly one of Bullet's meshes with a tree, scaled or with materials too, the vertex arrays are
/// locked once a part instead of once a triangle. Bullet's tree is walked and vertices are read in every call, so that
/// edits of any kind are seen at once. Any other shape reports its triangles itself.
///
/// @param low, high in the shape's frame
void forEachTriangle(const btConcaveShape& shape, btTriangleCallback& callback, const btVector3& low,
                     const btVector3& high);
}  // namespace CULLET_PRECISION
}  // namespace cullet
