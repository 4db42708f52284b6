// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstdint>

namespace cullet
{
/// Outcome of a query between two convex shapes. "Size" is the largest extent of their Minkowski difference as seen by
/// the query; statements hold up to the rounding of the supports, about 4e-7 of the size for float hulls, and a search may
/// take shapes for touching whose distance is less than 1e-7 of it.
enum class GjkState : std::uint8_t
{
    /// The distance is larger than maxDistance; `axis` proves it. No distance and no points.
    Separated,
    /// 0 < distance <= maxDistance. gjkDistance(): distance, points and axis are valid. isaGjk(): `axis` separates the
    /// shapes by less than maxDistance; no distance and no points.
    Near,
    /// The shapes have a point in common, or touch. Distance 0; no axis and no points; see epa.h for the depth.
    Overlapping,
    /// The interval of possible distances stopped shrinking before it answered the question: an input was not finite,
    /// or the shapes are degenerate beyond double precision. Nothing else is valid; ask another algorithm.
    NotConverged
};

/// @see GjkState for what is valid when.
template <class S>
struct GjkResult
{
    using Vector = Eigen::Matrix<S, 3, 1>;

    GjkState state = GjkState::NotConverged;
    std::int32_t iterations =
        0;  ///< simplices solved, edges of a corner among them; 0 if what was remembered was enough
    S distance = S(0);  ///< gjkDistance() only
    Vector axis =
        Vector::Zero();  ///< from B to A, world axes; unit length from gjkDistance(), any from isaGjk()
    Vector pointA = Vector::Zero();  ///< closest point of A, world axes, relative to the origin of A
    Vector pointB =
        Vector::Zero();  ///< closest point of B, in the same frame: also relative to the origin of *A*
};

/// What a query remembers for the next one between the same two shapes in the same order. 36 bytes.
///
/// Whatever it holds, the answer is right; a cache of another pair or of moved shapes costs time only. Vertex ids have
/// 16 bits: vertices from 65535 on are not remembered.
template <class S>
struct GjkCache
{
    static constexpr std::uint16_t kUnknown = 0xffff;

    /// Likely separates: one that has, or is near one that has. Largest component from a half to 1, or zero: none.
    std::array<float, 3> axis = {};
    std::array<std::uint16_t, 4> verticesA = {};  ///< the last simplex
    std::array<std::uint16_t, 4> verticesB = {};
    std::uint16_t startA = kUnknown;  ///< support vertices along the one that has separated
    std::uint16_t startB = kUnknown;
    GjkState state = GjkState::NotConverged;
    std::uint8_t count = 0;  ///< vertex pairs of the simplex
};
static_assert(sizeof(GjkCache<float>) <= 40 && sizeof(GjkCache<double>) <= 40);

/// @param axis scaled as the cache wants it
template <class S, class H>
void rememberAxis(const Eigen::Matrix<H, 3, 1>& axis, GjkCache<S>& cache)
{
    for (int i = 0; i < 3; ++i)
        cache.axis[i] = static_cast<float>(axis[i]);
}

/// Where a search begins; the answer is the same. All but Memory are for comparison.
enum class GjkStart : std::uint8_t
{
    Memory,         ///< all that the cache remembers; for hulls also the corner where the first axis fails
    Axis,           ///< one support point, against the cache's axis, or without one that between the centres
    FourDirections  ///< four support points in directions that are always the same, whatever the cache remembers
};

/// A vertex as the cache stores it.
template <class S>
std::uint16_t narrowId(std::int32_t vertex)
{
    // A negative one becomes the largest.
    const std::uint32_t unknown = GjkCache<S>::kUnknown;
    return static_cast<std::uint16_t>(std::min(static_cast<std::uint32_t>(vertex), unknown));
}

/// Observer that sees nothing. An observer is called once per support of a search with its direction v and v.w for the
/// support point w against v: v.w / |v| is not more than the distance. Once there is a simplex, v is its point closest to
/// the origin, and |v| not less than the distance.
struct NoObserver
{
    void operator()(const Eigen::Vector3d&, double) const {}
};
}  // namespace cullet
