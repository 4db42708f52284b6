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
/// A little more than a limit: cores that a search finds farther apart are so on any way to the answer.
btScalar beyond(const ConvexPair& pair, const ConvexCores& cores, btScalar limit);

/// Is the distance of the cores larger than a limit?
///
/// @param far    see beyond()
/// @param failed see isaGjk()
/// @return Separated; Near or Overlapping; NotConverged
GjkState separation(const ConvexPair& pair, const ConvexCores& cores, btScalar far,
                    const AxisTest<btScalar>& failed, GjkCache<btScalar>& cache);

/// What two polytopes' distance or depth is.
struct Found
{
    GjkState state;
    /// It depends on shapes and poses alone, whatever the search began with.
    bool isSettled;
};

/// Distance or depth of two polytopes.
///
/// @param memory null: the pair will not be asked again
/// @param far    see beyond()
/// @param touch  [out] valid for Near and Overlapping
/// @param exactTotal counts depths that only the exact search has found
Found measure(const ConvexCores& cores, btScalar limit, btScalar far, GjkCache<btScalar>& cache,
              EpaCache* memory, Touch& touch, ThreadCounter& exactTotal);
}  // namespace CULLET_PRECISION
}  // namespace cullet
