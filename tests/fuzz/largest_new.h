// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>

/// Replaced operator new of the programs that link largest_new.cpp.
namespace cullet::test
{
/// Forgets the allocations of this thread so far.
void resetLargestNew() noexcept;

/// Bytes of the largest allocation of this thread since then.
std::size_t largestNew() noexcept;
}  // namespace cullet::test
