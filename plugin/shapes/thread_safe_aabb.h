// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Whether getAabb() of the shape is known to write to nothing and to ask no other shape, so that several threads may
/// call it: shapes that are exactly of one of Bullet's classes, as listed at WorldBoxes.
///
/// A derived class may compute lazily what its base does not, and is not one of them. False is always safe.
bool hasPureAabb(const btCollisionShape& shape);
}  // namespace CULLET_PRECISION
}  // namespace cullet
