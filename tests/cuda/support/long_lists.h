// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet::test
{
// How many places are wrong after the executor of the GPU has done that to so many elements.

std::uint64_t wrongAfterScan(std::uint64_t count);
std::uint64_t wrongAfterSort(std::uint64_t count);

/// Memory that wrongAfterSort() takes, which is the larger one.
inline std::uint64_t bytesForSort(std::uint64_t count)
{
    return 4 * sizeof(std::uint64_t) * count;
}
}  // namespace cullet::test
