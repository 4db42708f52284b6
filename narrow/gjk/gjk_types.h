// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstdint>

namespace cullet
{
/// Outcome of a query between two convex shapes. "Size" is the largest length of a point of their Minkowski difference
/// that the query has computed; statements hold up to the rounding of the supports, about 4e-7 of the size for float
/// hulls, and a search may treat shapes whose distance is less than 1e-7 of it as touching. Points are rounded besides, by
/// up to half an epsilon of their distance from the origin of A.
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
    /// or the shapes are degenerate beyond double precision. No other member is valid; use another algorithm.
    NotConverged
};

/// @see GjkState for what is valid when.
template <class S>
struct GjkResult
{
    using Vector = Eigen::Matrix<S, 3, 1>;

    GjkState state = GjkState::NotConverged;
    std::int32_t iterations =
        0;              ///< simplices solved, including edges of a corner; 0 if the cache was enough
    S distance = S(0);  ///< gjkDistance() only
    Vector axis =
        Vector::Zero();  ///< from B to A, world axes; unit length from gjkDistance(), any from isaGjk()
    Vector pointA = Vector::Zero();  ///< closest point of A, world axes, relative to the origin of A
    Vector pointB =
        Vector::Zero();  ///< closest point of B, in the same frame: also relative to the origin of *A*
};

/// The state that a query keeps for the next query of the same two shapes in the same order. 36 bytes.
///
/// The answer is right with any content; a cache of another pair or of moved shapes only costs time. Vertex ids have 16
/// bits: vertices from 65535 on are not stored.
template <class S>
struct GjkCache
{
    static constexpr std::uint16_t kUnknown = 0xffff;

    /// Likely a separating axis: the last one, or one near it. Largest component from a half to 1; zero: none.
    std::array<float, 3> axis = {};
    std::array<std::uint16_t, 4> verticesA = {};  ///< the last simplex
    std::array<std::uint16_t, 4> verticesB = {};
    std::uint16_t startA = kUnknown;  ///< support vertices along the last separating axis
    std::uint16_t startB = kUnknown;
    GjkState state = GjkState::NotConverged;
    std::uint8_t count = 0;  ///< vertex pairs of the simplex
};
static_assert(sizeof(GjkCache<float>) <= 40 && sizeof(GjkCache<double>) <= 40);

/// @param axis its largest component is from a half to 1
template <class S, class H>
void rememberAxis(const Eigen::Matrix<H, 3, 1>& axis, GjkCache<S>& cache)
{
    for (int i = 0; i < 3; ++i)
        cache.axis[i] = static_cast<float>(axis[i]);
}

/// Where a search begins; the answer does not depend on it. Values other than Memory are for comparison.
enum class GjkStart : std::uint8_t
{
    Memory,         ///< the whole content of the cache; for hulls also the corner where the first axis fails
    Axis,           ///< one support point, against the cache's axis, or else the line between the centres
    FourDirections  ///< four support points in fixed directions; the cache is ignored
};

/// A vertex id in the cache's 16 bits.
template <class S>
std::uint16_t narrowId(std::int32_t vertex)
{
    // A negative id becomes the largest unsigned number.
    const std::uint32_t unknown = GjkCache<S>::kUnknown;
    return static_cast<std::uint16_t>(std::min(static_cast<std::uint32_t>(vertex), unknown));
}

/// Observer that does nothing. An observer is called once per support of a search with its direction v and v.w for the
/// support point w against v: v.w / |v| is not more than the distance. Once there is a simplex, v is its point closest
/// to the origin, and |v| not less than the distance.
struct NoObserver
{
    void operator()(const Eigen::Vector3d&, double) const {}
};
}  // namespace cullet
