// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/support.h"

#include <cstdint>

namespace cullet
{
/// A vertex of each of two hulls.
struct VertexPair
{
    std::int32_t a, b;
};

/// supportClimbArtificial() on two hulls with interleaved steps: the latencies overlap, and one branch ends both. A
/// climb that has ended stays at its vertex.
///
/// @param start of both climbs
template <class S>
[[gnu::noinline]] VertexPair climbBoth(const Hull<S>& hullA, const Eigen::Matrix<S, 3, 1>& directionA,
                                       const Hull<S>& hullB, const Eigen::Matrix<S, 3, 1>& directionB,
                                       const VertexPair& start)
{
    const LaneDirection<S> lanesA(directionA), lanesB(directionB);
    std::int32_t vertexA = start.a, vertexB = start.b;
    for (;;)
    {
        const ClimbStep<S> a = climbStep(hullA, vertexA, lanesA);
        const ClimbStep<S> b = climbStep(hullB, vertexB, lanesB);
        const bool risesA = a.bestHeight > a.height, risesB = b.bestHeight > b.height;
        // Bitwise | of integers, since || would add a branch.
        if ((static_cast<int>(risesA) | static_cast<int>(risesB)) == 0)
            return {endOfClimb(hullA, directionA, lanesA, vertexA, a).vertex,
                    endOfClimb(hullB, directionB, lanesB, vertexB, b).vertex};
        vertexA = risesA ? a.best : vertexA;
        vertexB = risesB ? b.best : vertexB;
    }
}
}  // namespace cullet
