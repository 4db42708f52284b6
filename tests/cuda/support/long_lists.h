// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet::test
{
// Number of wrong elements after the GPU's executor has scanned `count` elements.

std::uint64_t wrongAfterScan(std::uint64_t count);
std::uint64_t wrongAfterSort(std::uint64_t count);

/// Memory of wrongAfterSort(), which needs more than wrongAfterScan().
inline std::uint64_t bytesForSort(std::uint64_t count)
{
    return 4 * sizeof(std::uint64_t) * count;
}
}  // namespace cullet::test
