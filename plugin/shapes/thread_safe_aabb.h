// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Whether getAabb() of the shape writes nothing and calls no other shape, so that several threads may call it: true
/// for shapes that are exactly of one of Bullet's classes listed at WorldBoxes.
///
/// False for derived classes, which may compute lazily what their base does not. False is always safe.
bool hasThreadSafeAabb(const btCollisionShape& shape);
}  // namespace CULLET_PRECISION
}  // namespace cullet
