// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet
{
/// Two rows of the proxy table, unordered, found to overlap.
struct RowPair
{
    std::uint32_t a;
    std::uint32_t b;
};
}  // namespace cullet
