// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/shapes/hull_cache.h"

#include <cstdint>

class btCollisionShape;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A hash of all that a contact depends on of a hull, box, capsule or sphere beside its pose. It shows any change of the
/// shape, and another shape at the address of a deleted one; with 64 bits it is not equal for others by chance.
///
/// Of a concave shape it has the address, the type and the margin, and nothing of the triangles.
///
/// @param hull [in, out] of the shape, if it is a hull
/// @param pass see HullCache::hullOf()
/// @return 0 for a shape whose changes would not be seen, and if out of memory
std::uint64_t hashOfShape(const btCollisionShape& shape, HullUse& hull, std::uint64_t pass) noexcept;

/// Bounds the distance from the origin of such a shape to any of its points, margin included; infinite for a concave one.
btScalar radiusOfShape(const btCollisionShape& shape, HullUse& hull, std::uint64_t pass) noexcept;
}  // namespace CULLET_PRECISION
}  // namespace cullet
