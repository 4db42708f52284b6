// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/pair.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace cullet
{
/// Sorts the keys (pairKey()) and writes their pairs.
inline void writeSorted(std::vector<std::uint64_t>& keys, std::vector<Pair>& pairs)
{
    std::sort(keys.begin(), keys.end());
    pairs.resize(keys.size());
    std::transform(keys.begin(), keys.end(), pairs.begin(), pairOfKey);
}
}  // namespace cullet
