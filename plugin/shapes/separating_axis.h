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
/// A polytope whose core is a hull scaled along its own axes.
struct StretchedHull
{
    const Hull<btScalar>* hull;
    const btVector3* stretch;
    const btTransform* transform;
};

/// Four components of a btVector3, of which the last is unused.
using Components = Quad<btScalar>::Vector;

inline void read(const btVector3& v, Components& components)
{
    std::memcpy(&components, v.m_floats, sizeof(components));
}

inline btScalar largestOf(const Components& v)
{
    return std::max(std::max(v[0], v[1]), v[2]);
}

/// Not inlined, since a loop would keep the direction in memory.
///
/// @param start [in, out] a vertex as stored in the cache, see hitNearVertex(); afterwards the highest vertex
[[gnu::noinline]] inline btScalar heightNearVertex(const Hull<btScalar>& hull, const Components& local,
                                                   btScalar band, std::uint16_t& start)
{
    const SupportHit<btScalar> hit = hitNearVertex(hull, local, band, start);
    start = narrowId<btScalar>(hit.vertex);
    return hit.height;
}

/// Maximum product of a core's points with a direction, relative to its origin.
///
/// @param start [in, out] the vertex of the maximum, as a start for the next search; unchanged for few vertices
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
        // Nearly always true with temporal coherence.
        if (isPeak(hull, start, lanes, band, height, beside))
            return height;
        start = narrowId<btScalar>(beside);
    }
    // A copy, so that the direction can stay in registers until here.
    const Components copy = local;
    return heightNearVertex(hull, copy, band, start);
}

/// For two cores the growth of the height along an axis per unit of arc length, by which the core turns on a ball that
/// contains it.
///
/// A core lies in the ball of radius r around its origin and, along an axis of length l, below its height h. Turned by
/// an angle t, its height is at most that of the turned part of the ball below h: sqrt(r^2 l^2 - h^2) sin t + h cos t,
/// which is less than h + sqrt(l^2 - h^2 / r^2) (r t).
class TurnRates
{
public:
    /// Lower limit of a rate, so that a motion bound can include terms that do not depend on rates, divided by it.
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
        // Tolerance for rounding, and for a basis that is not exactly a rotation.
        const S sine2 = length2 * S(1.0001) - cosine * cosine;
        return static_cast<std::uint8_t>(S(128) * squareRoot(std::max(S(kLeast * kLeast), sine2)) + S(2));
    }

    std::uint8_t m_a = 0, m_b = 0;
};

/// The surplus of a separation proof by an axis.
struct AxisSurplus
{
    btScalar left = 0;  ///< lower bound of the gap beyond the required one, times the length of the axis
    TurnRates rates;
};

/// The result of a failed proof for isaGjk(), which then does not test the axis again.
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

/// Whether the cached axis still proves that the cores are farther apart than `limit`: the first step of isaGjk(), in
/// the precision of the shapes with a bound of its rounding. It suffices for four of five pairs.
///
/// False proves nothing; isaGjk() must decide.
/// @param limit length unit of the world, not negative
/// @param cache its support vertices are updated
/// @param surplus   [out] if not null
/// @param failed [out] if not null and the result is false: the gap along the axis, if its support vertices are known
[[gnu::always_inline]] inline bool staysSeparated(const StretchedHull& a, const StretchedHull& b,
                                                  btScalar limit, GjkCache<btScalar>& cache,
                                                  AxisSurplus* surplus = nullptr,
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
    // The rounding error of each product and sum is less than two roundings of its operands.
    distances += sizes + stretch;
    const btScalar size = Quad<btScalar>::sumOfThree(distances);
    const Components products = apart * axis, squares = axis * axis;
    const btScalar along = Quad<btScalar>::sumOfThree(products) - heightA - heightB;
    const btScalar length2 = Quad<btScalar>::sumOfThree(squares);
    const btScalar gap = limit + 16 * std::numeric_limits<btScalar>::epsilon() * size;
    // A NaN makes the comparisons false, and an infinite gap proves nothing.
    if (!(along > 0 && along <= std::numeric_limits<btScalar>::max() && along * along > gap * gap * length2))
    {
        if (failed != nullptr)
            *failed = failedTest(a, b, along, cache);
        return false;
    }
    if (surplus != nullptr)
    {
        // The error is again less than four roundings of a value of at most twice the size.
        const btScalar rest =
            along - (gap + 16 * std::numeric_limits<btScalar>::epsilon() * size) * squareRoot(length2);
        surplus->left = std::max(rest, btScalar(0));
        surplus->rates = TurnRates(largestOf(sizes), heightA, largestOf(stretch), heightB, length2);
    }
    return true;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
