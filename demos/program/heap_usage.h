// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet
{
/// Bytes that the process has got from malloc and not given back, with malloc's own overhead; mapped blocks included.
///
/// The memory of a structure is the difference that freeing it makes. Costs up to milliseconds (it walks the free
/// lists), and nothing while it is not asked.
std::uint64_t heapBytesInUse();
}  // namespace cullet
