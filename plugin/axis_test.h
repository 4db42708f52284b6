// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/gjk_types.h"
#include "narrow/support.h"

#include <LinearMath/btTransform.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A polytope whose core is a hull stretched along its own axes.
struct StretchedHull
{
    const Hull<btScalar>* hull;
    const btVector3* stretch;
    const btTransform* transform;
};

/// Four components of Bullet's, of which the last means nothing.
using Components = Quad<btScalar>::Vector;

inline void read(const btVector3& v, Components& components)
{
    std::memcpy(&components, v.m_floats, sizeof(components));
}

/// Highest product of a core's points with a direction, relative to its origin, and the vertex that has it.
inline btScalar heightAlong(const StretchedHull& core, const Components& direction, std::int32_t& vertex)
{
    const Hull<btScalar>& hull = *core.hull;
    const btMatrix3x3& basis = core.transform->getBasis();
    Components x, y, z, local;
    read(basis[0], x);
    read(basis[1], y);
    read(basis[2], z);
    read(*core.stretch, local);
    local *= x * direction[0] + y * direction[1] + z * direction[2];
    const Eigen::Matrix<btScalar, 3, 1> along(local[0], local[1], local[2]);
    const bool isKnown = vertex < hull.blockCount();
    if (isKnown)
    {
        btScalar height;
        const btScalar band = hull.tieBand() * (std::abs(local[0]) + std::abs(local[1]) + std::abs(local[2]));
        // The climb would end where it starts: in a coherent scene nearly always.
        if (isPeak(hull, vertex, LaneDirection<btScalar>(along), band, height))
            return height;
    }
    const SupportHit<btScalar> hit =
        isKnown ? supportClimbArtificial(hull, along, vertex) : hitLinear(hull, along);
    vertex = hit.vertex;
    return hit.height;
}

/// True if the remembered axis still proves that the cores are farther apart than `limit`: the first step of isaGjk(),
/// in the precision of the shapes with a bound of its rounding, since four of five pairs need no more.
///
/// False says nothing; ask isaGjk().
/// @param limit length unit of the world, not negative
/// @param cache its support vertices follow
/// @param leeway [out] if not null: at most how much farther apart than `limit` the cores are, in real numbers
inline bool staysSeparated(const StretchedHull& a, const StretchedHull& b, btScalar limit,
                           GjkCache<btScalar>& cache, btScalar* leeway = nullptr)
{
    const Components axis = {btScalar(cache.axis[0]), btScalar(cache.axis[1]), btScalar(cache.axis[2])};
    const Components opposite = -axis;
    std::int32_t vertexA = cache.startA, vertexB = cache.startB;
    const btScalar heightA = heightAlong(a, opposite, vertexA);
    const btScalar heightB = heightAlong(b, axis, vertexB);
    cache.startA = static_cast<std::uint16_t>(std::min(vertexA, 0xffff));
    cache.startB = static_cast<std::uint16_t>(std::min(vertexB, 0xffff));
    Components apart, origin, sizes, stretch;
    read(a.transform->getOrigin(), apart);
    read(b.transform->getOrigin(), origin);
    apart -= origin;
    read(*a.stretch, sizes);
    read(*b.stretch, stretch);
    Quad<btScalar>::makePositive(sizes);
    Quad<btScalar>::makePositive(stretch);
    Components distances = apart;
    Quad<btScalar>::makePositive(distances);
    sizes = sizes * a.hull->reach() + stretch * b.hull->reach() + distances;
    // Each product and sum is off by less than two roundings of the sizes that enter it.
    const btScalar size = sizes[0] + sizes[1] + sizes[2];
    const Components products = apart * axis, squares = axis * axis;
    const btScalar along = products[0] + products[1] + products[2] - heightA - heightB;
    const btScalar length2 = squares[0] + squares[1] + squares[2];
    const btScalar gap = limit + 16 * std::numeric_limits<btScalar>::epsilon() * size;
    // A NaN makes the comparisons false.
    if (!(along > 0 && along * along > gap * gap * length2))
        return false;
    // The division is off by less than four roundings of what is at most twice the size.
    if (leeway != nullptr)
        *leeway = along / std::sqrt(length2) - gap - 16 * std::numeric_limits<btScalar>::epsilon() * size;
    return true;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
