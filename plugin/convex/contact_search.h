// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/epa/epa_cache.h"
#include "cullet/narrow/gjk/gjk_types.h"
#include "cullet/plugin/contact/contact_patch.h"
#include "cullet/plugin/convex/convex_pair.h"
#include "cullet/plugin/core/thread_counter.h"
#include "cullet/plugin/shapes/separating_axis.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The radius of a ball around a core's origin that contains the core.
///
/// @param core of a polytope
double radiusOf(const ConvexSide& side, const std::optional<PosedShape>& core);

/// A limit plus a bound of rounding errors: cores that one search finds farther apart than this are farther apart than
/// the limit in every search.
btScalar padLimit(const ConvexPair& pair, const ConvexCores& cores, btScalar limit);

/// Tests whether the distance of the cores exceeds a limit.
///
/// @param paddedLimit    see padLimit()
/// @param failed see isaGjk()
/// @return Separated; Near or Overlapping; NotConverged
GjkState testSeparation(const ConvexPair& pair, const ConvexCores& cores, btScalar paddedLimit,
                        const AxisTest<btScalar>& failed, GjkCache<btScalar>& cache);

/// The outcome of a search for the distance or depth of two polytopes.
struct ContactSearchResult
{
    GjkState state;
    /// It depends on shapes and poses alone, not on the start of the search.
    bool isSettled;
};

/// Distance or depth of two polytopes.
///
/// @param depthCache null: the pair is not queried again
/// @param paddedLimit    see padLimit()
/// @param touch  [out] valid for Near and Overlapping
/// @param exactTotal counts depths that only the exhaustive search has found
ContactSearchResult measure(const ConvexCores& cores, btScalar limit, btScalar paddedLimit,
                            GjkCache<btScalar>& cache, EpaCache* depthCache, Touch& touch,
                            ThreadCounter& exactTotal);
}  // namespace CULLET_PRECISION
}  // namespace cullet
