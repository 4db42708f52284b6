// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/hull_pairs.h"

#include <random>
#include <vector>

namespace cullet::test
{
/// randomPair() of any two hulls, the second of which is drawn first: in the order in which GCC evaluates
/// arguments, which recorded counts rely on.
template <class S>
PairScene<S> anyPair(const std::vector<Hull<S>>& hulls, double gap, double farAway, std::mt19937& engine)
{
    const Hull<S>& hullB = hulls[engine() % hulls.size()];
    const Hull<S>& hullA = hulls[engine() % hulls.size()];
    return randomPair(hullA, hullB, gap, farAway, engine);
}
}  // namespace cullet::test
