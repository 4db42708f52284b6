// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
class ParallelLoops;

/// Boxes to be ordered: six floats each, three minima and three maxima.
struct BoxesToOrder
{
    const float (*planes)[6];  ///< by id; valid and finite for every id to be ordered
    const std::uint32_t* ids;  ///< [count] which boxes, each once; null: 0 .. count - 1
    std::size_t count;
};

/// A slot without a box.
inline constexpr std::uint32_t kEmptySlot = UINT32_MAX;

/// The id of the box in each slot of a complete tree with eight children per node, whose leaves have eight slots.
///
/// Children are separated by medians (a k-d tree with eight children per node), separately for boxes of different
/// orders of magnitude, so that a large box does not enlarge a leaf of small ones. Ranks, not coordinates, decide the
/// shape: the depth is log8 of the boxes whatever they are. The number of slots is a multiple of eight. O(n log n).
///
/// @param loops null: one thread; the order is the same for any number of threads
std::vector<std::uint32_t> wideTreeOrder(const BoxesToOrder& boxes, ParallelLoops* loops);
}  // namespace cullet
