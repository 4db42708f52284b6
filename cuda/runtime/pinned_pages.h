// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet
{
/// Locks the pages of memory from BoxAllocator until it is freed, so that the device copies it at full speed.
///
/// @param bytes all of the memory, or more of it than in the last call
/// @return false where locking fails, which is no error: the caller then copies through locked memory of its own.
///     Small arrays are not locked, since that would cost more than it saves.
/// Threads: any
bool lockPages(const void* memory, std::uint64_t bytes) noexcept;
}  // namespace cullet
