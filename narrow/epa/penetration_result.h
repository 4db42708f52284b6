// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/gjk/gjk_types.h"

#include <Eigen/Core>

#include <cstdint>

namespace cullet
{
/// How a depth was found.
enum class PenetrationMethod : std::uint8_t
{
    None,       ///< no depth: the shapes do not overlap, or the state is NotConverged
    Expansion,  ///< expanding polytope, proved by its dual gap
    Exact,      ///< all faces and pairs of edges, after the expansion could not prove its answer
    Flat        ///< the Minkowski difference has no volume: depth 0 along its normal
};

template <class S>
struct PenetrationResult
{
    using Vector = Eigen::Matrix<S, 3, 1>;

    /// Overlapping, and all other members are valid; or the state that the distance query would return, and no other
    /// member is valid.
    GjkState state = GjkState::NotConverged;
    PenetrationMethod method = PenetrationMethod::None;
    std::int32_t iterations = 0;   ///< points added to the polytope
    S depth = S(0);                ///< length of the shortest translation of A that leaves a touching contact
    S dualGap = S(0);              ///< the true depth is between depth - dualGap and depth
    Vector axis = Vector::Zero();  ///< unit, from B to A, world axes: A moved by depth * axis only touches
    Vector pointA = Vector::Zero();  ///< deepest point of A, world axes, relative to the origin of A
    Vector pointB = Vector::Zero();  ///< deepest point of B, same frame; pointB - pointA = depth * axis
    std::int32_t vertexA = -1;       ///< support vertex of A against the axis, -1: unknown
    std::int32_t vertexB = -1;       ///< support vertex of B along the axis, -1: unknown
    /// No other axis has so little depth, and the result depends on shapes and poses alone: see FeaturePair.
    bool isSettled = false;
};
}  // namespace cullet
