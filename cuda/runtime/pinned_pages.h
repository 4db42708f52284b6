// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet
{
/// Locks the pages of memory from BoxAllocator until it is given back, so that the device copies from it at full speed.
///
/// @param bytes all of the memory, or more of it than the last time
/// @return false where that cannot be done, which is no failure: the caller then copies by way of locked memory of its
///         own. Small arrays are not locked: that would cost more than it saves.
/// Threads: any
bool lockPages(const void* memory, std::uint64_t bytes) noexcept;
}  // namespace cullet
