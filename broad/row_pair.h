// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet
{
/// In the place of a row: none.
inline constexpr std::uint32_t kNoRow = 0xffffffffu;

/// Two rows of the proxy table, unordered, found to overlap.
struct RowPair
{
    std::uint32_t a;
    std::uint32_t b;
};
}  // namespace cullet
