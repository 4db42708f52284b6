// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet
{
/// Bytes allocated by malloc and not freed, including malloc's overhead and mapped blocks; 0 where the C library is not glibc,
/// which tells.
///
/// The memory of a structure is the difference across freeing it. A call takes up to milliseconds (malloc walks its
/// free lists).
std::uint64_t heapBytesInUse();
}  // namespace cullet
