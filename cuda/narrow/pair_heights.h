// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/cuda/narrow/posed_pair.h"

#include <cmath>
#include <cstdint>

/// What lets a pair that has hardly turned be answered without a look at its vertices.
namespace cullet::convex
{
/// How high two hulls are together, each along a direction of its own axes. That is true of the hulls, wherever their
/// bodies are: a direction that differs by e changes the height of a hull by no more than e times its reach.
struct alignas(16) PairHeights
{
    std::uint32_t directionA, directionB;  ///< as codeOf()
    float sum;                             ///< not less than both heights together
    std::uint32_t hulls;                   ///< as keyOf(); 0: nothing is known
};

/// Names the hulls of a pair in one word. 0 where an index is too large.
CULLET_HOST_DEVICE inline std::uint32_t keyOf(const HullView& a, const HullView& b)
{
    constexpr std::uint32_t kMost = 0xfffeu;
    return a.index() > kMost || b.index() > kMost ? 0 : (a.index() + 1) | (b.index() + 1) << 16;
}

/// The vector's direction on an octahedron whose lower half is folded outwards, two coordinates of 16 bits (Meyer et
/// al., On floating-point normal vectors, 2010).
///
/// @pre d is finite and not zero
CULLET_HOST_DEVICE inline std::uint32_t codeOf(const Vec<float>& d)
{
    const float scale = 1.0f / sumOfMagnitudes(d);
    const float x = d.x * scale, y = d.y * scale;
    const bool isFolded = d.z < 0.0f;
    const float u = isFolded ? copysignf(1.0f - fabsf(y), x) : x;
    const float v = isFolded ? copysignf(1.0f - fabsf(x), y) : y;
    const auto step = [](float coordinate)
    {
        const float place = coordinate * 32767.5f + 32768.0f;
        return static_cast<std::uint32_t>(place < 65535.0f ? place : 65535.0f);
    };
    return step(u) | step(v) << 16;
}

/// The unit vector of a code, up to rounding.
CULLET_HOST_DEVICE inline Vec<float> directionOf(std::uint32_t code)
{
    const auto coordinate = [](std::uint32_t step) { return static_cast<float>(step) / 32767.5f - 1.0f; };
    const float u = coordinate(code & 0xffffu), v = coordinate(code >> 16);
    const float z = 1.0f - fabsf(u) - fabsf(v);
    const Vec<float> d = z < 0.0f
                             ? Vec<float>{copysignf(1.0f - fabsf(v), u), copysignf(1.0f - fabsf(u), v), z}
                             : Vec<float>{u, v, z};
    return d * (1.0f / rootOf(dot(d, d)));
}

/// By how much both heights may have changed since those directions.
CULLET_HOST_DEVICE inline float changeSince(const PairHeights& known, const HullSide<float>& a,
                                            const HullSide<float>& b)
{
    const Vec<float> byA = a.direction - directionOf(known.directionA);
    const Vec<float> byB = b.direction - directionOf(known.directionB);
    const float change = a.hull.reach() * rootOf(dot(byA, byA)) + b.hull.reach() * rootOf(dot(byB, byB));
    return change * 1.00001f;  // for the rounding of these products
}

/// @param sum of the heights of both sides
CULLET_HOST_DEVICE inline PairHeights heightsOf(const HullSide<float>& a, const HullSide<float>& b, float sum)
{
    PairHeights heights = {codeOf(a.direction), codeOf(b.direction), 0.0f, keyOf(a.hull, b.hull)};
    heights.sum = sum + changeSince(heights, a, b);
    return heights;
}

/// Bounds the sum of both sides' heights from above. With the test's errors, which PosedPair::error() bounds, the
/// rounding of the sums here stays below 1.5 times that.
///
/// @return infinity where nothing is known of these hulls
CULLET_HOST_DEVICE inline float mostHeights(const PairHeights& known, const HullSide<float>& a,
                                            const HullSide<float>& b)
{
    if (known.hulls == 0 || known.hulls != keyOf(a.hull, b.hull))
        return INFINITY;
    return known.sum + changeSince(known, a, b);
}
}  // namespace cullet::convex
