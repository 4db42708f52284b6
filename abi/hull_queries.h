// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/abi/cullet.h"
#include "cullet/narrow/gjk/gjk_types.h"
#include "cullet/narrow/hull/hull.h"
#include "cullet/narrow/hull/posed_hull.h"

#include <cstddef>
#include <cstdint>
#include <memory>

struct cullet_hull
{
    cullet::Hull<double> hull;
};

namespace cullet::abi
{
/// The hull of a caller's points. Throws Failure.
///
/// @param points three doubles each
/// @param stride bytes from a point to the next; 0: 24
std::unique_ptr<cullet_hull> makeHullHandle(const double* points, std::size_t stride, std::uint32_t count);

/// A hull in the world. Throws Failure for a NULL hull, and a pose that is not finite or cannot be inverted.
///
/// @param pose NULL: identity
PosedHull<double> place(const cullet_hull* hull, const cullet_pose* pose);

/// What is computed for a pair of hulls; the numbers are those of CULLET_QUERY_*.
enum class HullQuery : std::int32_t
{
    Overlap,      ///< state, and a separating axis of any length
    Distance,     ///< where hulls are apart by up to a maximum; 0 where they overlap
    Penetration,  ///< depth where hulls overlap
    Contact       ///< both
};

/// The answer for one pair. `state` may be CULLET_NOT_CONVERGED; `size` is not set.
///
/// @param maxDistance not negative; of Distance and Contact
/// @param cache       of this pair in this order, or a new one
/// Errors: std::bad_alloc.
cullet_hull_result queryHulls(HullQuery query, const PosedHull<double>& a, const PosedHull<double>& b,
                              double maxDistance, GjkCache<double>& cache);
}  // namespace cullet::abi
