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

/// The transposed matrix times v, column by column: three products of a row with a scalar, all lanes at once.
inline btVector3 transposedProduct(const btMatrix3x3& m, const btVector3& v)
{
    using L = Lanes<btScalar>;
    btVector3 result;
    for (int lane = 0; lane < 4; lane += L::kWidth)
    {
        const typename L::Vector sum = L::load(&m[0].m_floats[lane]) * L::fill(v.x()) +
                                       L::load(&m[1].m_floats[lane]) * L::fill(v.y()) +
                                       L::load(&m[2].m_floats[lane]) * L::fill(v.z());
        std::memcpy(&result.m_floats[lane], &sum, sizeof(sum));
    }
    return result;
}

/// Highest product of a core's points with a direction, relative to its origin, and the vertex that has it.
inline btScalar heightAlong(const StretchedHull& core, const btVector3& direction, std::int32_t& vertex)
{
    const Hull<btScalar>& hull = *core.hull;
    const btVector3 turned = transposedProduct(core.transform->getBasis(), direction) * *core.stretch;
    const Eigen::Matrix<btScalar, 3, 1> local(turned.x(), turned.y(), turned.z());
    const bool isKnown = vertex < hull.vertexCount() && hull.hasNeighbours();
    if (isKnown)
    {
        btScalar height;
        const btScalar band = hull.tieBand() * local.cwiseAbs().sum();
        // The climb would end where it starts: in a coherent scene nearly always.
        if (isPeak(hull, vertex, LaneDirection<btScalar>(local), band, height))
            return height;
    }
    const SupportHit<btScalar> hit =
        isKnown ? supportClimbArtificial(hull, local, vertex) : hitLinear(hull, local);
    vertex = hit.vertex;
    return hit.height;
}

inline btScalar sumOfMagnitudes(const btVector3& v)
{
    return std::abs(v.x()) + std::abs(v.y()) + std::abs(v.z());
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
    const btVector3 axis(btScalar(cache.axis[0]), btScalar(cache.axis[1]), btScalar(cache.axis[2]));
    std::int32_t vertexA = cache.startA, vertexB = cache.startB;
    const btScalar heightA = heightAlong(a, -axis, vertexA);
    const btScalar heightB = heightAlong(b, axis, vertexB);
    cache.startA = static_cast<std::uint16_t>(std::min(vertexA, 0xffff));
    cache.startB = static_cast<std::uint16_t>(std::min(vertexB, 0xffff));
    const btVector3 apart = a.transform->getOrigin() - b.transform->getOrigin();
    const btScalar along = apart.dot(axis) - heightA - heightB;
    // Each product and sum is off by less than two roundings of the sizes that enter it.
    const btScalar size = sumOfMagnitudes(apart) + btScalar(a.hull->radius()) * sumOfMagnitudes(*a.stretch) +
                          btScalar(b.hull->radius()) * sumOfMagnitudes(*b.stretch);
    const btScalar gap = limit + 16 * std::numeric_limits<btScalar>::epsilon() * size;
    // A NaN makes the comparisons false.
    if (!(along > 0 && along * along > gap * gap * axis.length2()))
        return false;
    // The division is off by less than four roundings of what is at most twice the size.
    if (leeway != nullptr)
        *leeway = along / axis.length() - gap - 16 * std::numeric_limits<btScalar>::epsilon() * size;
    return true;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
