// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/gjk/gjk_types.h"
#include "cullet/narrow/gjk/hull_pair.h"
#include "cullet/narrow/hull/support.h"

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

inline btScalar largestOf(const Components& v)
{
    return std::max(std::max(v[0], v[1]), v[2]);
}

/// Out of line, since a loop would keep the direction in memory.
///
/// @param start [in, out] a vertex as the cache stores it, see hitBeside(); then the highest
[[gnu::noinline]] inline btScalar heightBeside(const Hull<btScalar>& hull, const Components& local,
                                               btScalar band, std::uint16_t& start)
{
    const SupportHit<btScalar> hit = hitBeside(hull, local, band, start);
    start = narrowId<btScalar>(hit.vertex);
    return hit.height;
}

/// Highest product of a core's points with a direction, relative to its origin.
///
/// @param start [in, out] the vertex that has it, where it is of use: with few vertices it stays as it is
[[gnu::always_inline]] inline btScalar heightAlong(const StretchedHull& core, const Components& direction,
                                                   std::uint16_t& start)
{
    const Hull<btScalar>& hull = *core.hull;
    const btMatrix3x3& basis = core.transform->getBasis();
    Components x, y, z, local;
    read(basis[0], x);
    read(basis[1], y);
    read(basis[2], z);
    read(*core.stretch, local);
    local *= x * direction[0] + y * direction[1] + z * direction[2];
    const LaneDirection<btScalar> lanes(local);
    if (hull.vertexCount() <= kFewVertices)
        return largestProduct(hull, lanes);
    Components magnitudes = local;
    Quad<btScalar>::makePositive(magnitudes);
    const btScalar band = hull.tieBand() * Quad<btScalar>::sumOfThree(magnitudes);
    if (start < hull.blockCount())
    {
        btScalar height;
        std::int32_t beside;
        // In a coherent scene nearly always.
        if (isPeak(hull, start, lanes, band, height, beside))
            return height;
        start = narrowId<btScalar>(beside);
    }
    // A copy, so that the direction is in no memory before.
    const Components copy = local;
    return heightBeside(hull, copy, band, start);
}

/// How much higher along an axis each of two cores may be for each unit of arc that it turns on a sphere of its reach.
///
/// A core lies in the ball of radius r around its origin and below its height h along the axis, of length l. Turned by an
/// angle t it is not higher than the highest point of the cap's complement turned alike, sqrt(r^2 l^2 - h^2) sin t +
/// h cos t at most, which is below h + sqrt(l^2 - h^2 / r^2) (r t).
class TurnRates
{
public:
    /// No rate is less, so that a motion may carry what does not depend on it.
    static constexpr float kLeast = 0.125f;

    TurnRates() = default;
    /// @param reaches the r of both cores, @param heights their h, @param length2 the square of l, at most 3
    template <class S>
    TurnRates(S reachA, S heightA, S reachB, S heightB, S length2)
        : m_a(rounded(reachA, heightA, length2)), m_b(rounded(reachB, heightB, length2))
    {
    }
    float a() const { return m_a * (1.0f / 128); }
    float b() const { return m_b * (1.0f / 128); }

private:
    template <class S>
    static std::uint8_t rounded(S reach, S height, S length2)
    {
        const S cosine = height > 0 ? height / reach : S(0);
        // Room for rounding, and for a basis that is not quite a rotation.
        const S sine2 = length2 * S(1.0001) - cosine * cosine;
        return static_cast<std::uint8_t>(S(128) * squareRoot(std::max(S(kLeast * kLeast), sine2)) + S(2));
    }

    std::uint8_t m_a = 0, m_b = 0;
};

/// What an axis leaves over after it has proved what was asked for.
struct AxisRoom
{
    btScalar left =
        0;  ///< at most how much farther apart than needed the cores are, times the length of the axis
    TurnRates rates;
};

/// How an axis has failed, for isaGjk(), which then need not look along it again.
inline AxisTest<btScalar> failedTest(const StretchedHull& a, const StretchedHull& b, btScalar along,
                                     const GjkCache<btScalar>& cache)
{
    AxisTest<btScalar> test;
    const auto isKnown = [](const StretchedHull& core, std::uint16_t vertex)
    { return core.hull->vertexCount() > kFewVertices && vertex < core.hull->vertexCount(); };
    if (!std::isfinite(along) || !isKnown(a, cache.startA) || !isKnown(b, cache.startB))
        return test;
    test.along = along;
    test.vertexA = cache.startA;
    test.vertexB = cache.startB;
    return test;
}

/// True if the remembered axis still proves that the cores are farther apart than `limit`: the first step of isaGjk(),
/// in the precision of the shapes with a bound of its rounding, since four of five pairs need no more.
///
/// False says nothing; ask isaGjk().
/// @param limit length unit of the world, not negative
/// @param cache its support vertices follow
/// @param room   [out] if not null
/// @param failed [out] if not null and the answer is false: how far the axis goes, if its support vertices are known
[[gnu::always_inline]] inline bool staysSeparated(const StretchedHull& a, const StretchedHull& b,
                                                  btScalar limit, GjkCache<btScalar>& cache,
                                                  AxisRoom* room = nullptr,
                                                  AxisTest<btScalar>* failed = nullptr)
{
    const Components axis = {btScalar(cache.axis[0]), btScalar(cache.axis[1]), btScalar(cache.axis[2])};
    const Components opposite = -axis;
    const btScalar heightA = heightAlong(a, opposite, cache.startA);
    const btScalar heightB = heightAlong(b, axis, cache.startB);
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
    sizes *= a.hull->reach();
    stretch *= b.hull->reach();
    // Each product and sum is off by less than two roundings of the sizes that enter it.
    distances += sizes + stretch;
    const btScalar size = Quad<btScalar>::sumOfThree(distances);
    const Components products = apart * axis, squares = axis * axis;
    const btScalar along = Quad<btScalar>::sumOfThree(products) - heightA - heightB;
    const btScalar length2 = Quad<btScalar>::sumOfThree(squares);
    const btScalar gap = limit + 16 * std::numeric_limits<btScalar>::epsilon() * size;
    // A NaN makes the comparisons false, and what is infinite proves nothing.
    if (!(along > 0 && along <= std::numeric_limits<btScalar>::max() && along * along > gap * gap * length2))
    {
        if (failed != nullptr)
            *failed = failedTest(a, b, along, cache);
        return false;
    }
    if (room != nullptr)
    {
        // Again off by less than four roundings of what is at most twice the size.
        const btScalar rest =
            along - (gap + 16 * std::numeric_limits<btScalar>::epsilon() * size) * squareRoot(length2);
        room->left = std::max(rest, btScalar(0));
        room->rates = TurnRates(largestOf(sizes), heightA, largestOf(stretch), heightB, length2);
    }
    return true;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
