// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/grid/columns/pair_sinks.h"
#include "cullet/broad/grid/update/grid_core.h"
#include "cullet/broad/verlet/verlet_pairs.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Classifies pairs by their current boxes, which are the reference boxes too.
///
/// @param candidates all pairs that may come to overlap
/// @param held       held pairs so far; those that are no candidates are hysteresis pairs with a gap beyond the skins
/// @param pairs      [out] all pairs that may change or are held
void classifyPairs(GridCore& core, const ProxyView& view, const CollectingSink& candidates,
                   const std::vector<RowPair>& held, VerletPairs& pairs);
}  // namespace cullet
