// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/broad/row_pair.h"

#include <cstdint>
#include <limits>

/// Tests of pairs of rows in an update.
namespace cullet
{
/// The box, or NaN for an empty one: no comparison holds for NaN, not even with an infinite box.
inline Aabb nanIfEmpty(const Aabb& box)
{
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    return isValidBranchless(box) ? box : Aabb{{kNan, kNan, kNan}, {kNan, kNan, kNan}};
}

/// Whether the filter words of a view let a pair enter.
inline bool mayEnter(const ProxyView& view, RowPair pair)
{
    return view.filters == nullptr || passesFilter(view.filters[pair.a], view.filters[pair.b]);
}

/// Key of a pair of rows in either order, below kFreeKey.
inline std::uint64_t rowKey(RowPair pair)
{
    return pairKey(makePair(pair.a, pair.b));
}

/// The rows of a rowKey(), the lower one first.
inline RowPair rowsOf(std::uint64_t key)
{
    return {static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)};
}

/// The key of the unique ids of a pair.
inline std::uint64_t idsOf(const ProxyView& view, RowPair pair)
{
    return pairKey(makePair(view.uniqueIds[pair.a], view.uniqueIds[pair.b]));
}

inline bool isOverlapping(const ProxyView& view, RowPair pair)
{
    const Aabb& a = view.boxes[pair.a];
    const Aabb& b = view.boxes[pair.b];
    return overlapsBranchless(a, b) && isValidBranchless(a) && isValidBranchless(b);
}

/// overlapsWithMargin() without branches.
inline bool isWithinMargin(const ProxyView& view, RowPair pair)
{
    const Aabb& a = view.boxes[pair.a];
    const Aabb& b = view.boxes[pair.b];
    return overlapsWithMarginBranchless(a, b, view.margin) && isValidBranchless(a) && isValidBranchless(b);
}
}  // namespace cullet
