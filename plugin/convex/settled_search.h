// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/convex/contact_search.h"

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// What a search for a contact needs besides the cores.
struct SearchSetup
{
    const ConvexPair& pair;
    HullUse (&hulls)[2];
    std::uint64_t pass;         ///< see HullCache::hullOf()
    EpaCache* depthCache;       ///< null: the surface that proves a depth is not remembered
    bool makesPatch;            ///< the faces at the touch are needed
    ThreadCounter& exactTotal;  ///< see measure()
};

/// Distance or depth of two polytopes, determined by shapes and poses alone. The caches only select the start of the
/// search; the result is used if every start leads to it. Otherwise a search from scratch follows, and for hulls without
/// graphs a third one, after their graphs were built.
///
/// @param cores        a fan is set for a hull without a graph, if the setup makes a patch
/// @param failed       see isaGjk()
/// @param wasSettled   the last result did not depend on the start of its search
/// @param cache        [in, out]
/// @param touch        [out] valid for Near and Overlapping
/// @return Separated, Near, Overlapping or NotConverged
ContactSearchResult searchSettled(const SearchSetup& setup, ConvexCores& cores, btScalar limit,
                                  const AxisTest<btScalar>& failed, bool wasSettled,
                                  GjkCache<btScalar>& cache, Touch& touch);
}  // namespace CULLET_PRECISION
}  // namespace cullet
