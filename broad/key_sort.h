// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/pair.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Sorts keys of pairs (pairKey(), PairSet::keyOf()): by comparisons when they are few, else by radix sort on as many
/// bits as the ids have.
///
/// Cost: O(keys) for more than a few hundred; one pass over keys in order. Memory is kept between calls.
class KeySort
{
public:
    void sort(std::vector<std::uint64_t>& keys);

    /// @param keys  [in, out] sorted
    /// @param pairs [out] overwritten
    void write(std::vector<std::uint64_t>& keys, std::vector<Pair>& pairs);

private:
    void sortByRadix(std::vector<std::uint64_t>& keys, std::uint32_t bits);

    std::vector<std::uint64_t> m_swap;
    std::vector<std::uint32_t> m_offsets;
};
}  // namespace cullet
