// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet
{
/// Replaces counts by their exclusive prefix sums; returns the largest count.
///
/// Static, so that each source has its own copy: of shared ones, the linker might keep that of a source compiled for
/// instructions that not every processor has.
static inline std::uint32_t exclusiveSum(std::uint32_t* counts, std::uint32_t size)
{
    std::uint32_t sum = 0;
    std::uint32_t most = 0;
    for (std::uint32_t i = 0; i < size; ++i)
    {
        const std::uint32_t count = counts[i];
        counts[i] = sum;
        sum += count;
        most = count > most ? count : most;
    }
    return most;
}
}  // namespace cullet
