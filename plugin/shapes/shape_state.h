// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/shapes/hull_cache.h"

#include <LinearMath/btVector3.h>

#include <cstdint>

class btCollisionShape;
class btConvexPolyhedron;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// What a contact depends on of a hull, box, capsule or sphere beside its pose. Compared with an earlier state, it shows
/// any change of the shape, and another shape at the address of a deleted one.
///
/// Of a concave shape it has the address, the class of shape and the margin, and nothing of the triangles.
class ShapeState
{
public:
    /// Reads a shape.
    ///
    /// @param hull [in, out] of the shape, if it is a hull
    /// @param pass see HullCache::hullOf()
    /// @return false for a shape whose changes would not be seen, and if out of memory
    bool read(const btCollisionShape& shape, HullUse& hull, std::uint64_t pass) noexcept;

    bool operator==(const ShapeState& other) const noexcept;
    bool operator!=(const ShapeState& other) const noexcept { return !(*this == other); }

    /// Bounds the distance from the shape's origin to any of its points, margin included; infinite for a concave shape.
    btScalar radius() const noexcept { return m_radius; }

private:
    bool readConvex(const btCollisionShape& shape, HullUse& hull, std::uint64_t pass) noexcept;

    const btCollisionShape* m_shape = nullptr;
    const btConvexPolyhedron* m_features = nullptr;
    int m_type = -1;
    std::uint32_t m_revision = 0;  ///< of the hull's points
    int m_axis = 0;                ///< of a capsule
    btScalar m_margin = 0;
    btScalar m_radius = 0;
    btVector3 m_size = btVector3(0, 0, 0);  ///< extents, or the scale of a hull
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
