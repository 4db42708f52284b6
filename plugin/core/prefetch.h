// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <LinearMath/btTransform.h>

#include <cstddef>
#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Prefetches one byte of an object, which may be null: addresses are computed as integers, and a prefetch never faults.
/// Always inlined, since GCC takes a call that does nothing but prefetch for one without an effect, and drops it.
[[gnu::always_inline]] inline void prefetchByte(const void* object, std::size_t at)
{
    __builtin_prefetch(reinterpret_cast<const void*>(reinterpret_cast<std::uintptr_t>(object) + at));
}

/// Prefetches bytes [from, to) of an object, as prefetchByte(). `from` and `to` are multiples of 16, and the object is
/// aligned to 16.
[[gnu::always_inline]] inline void prefetchBytes(const void* object, std::size_t from, std::size_t to)
{
    prefetchByte(object, from);
    for (std::size_t at = from + 64; at + 16 < to; at += 64)
        prefetchByte(object, at);
    prefetchByte(object, to - 1);
}

/// Prefetches transform, shape and state of a btCollisionObject: the transform is at its beginning, the others follow
/// the second transform and five vectors.
[[gnu::always_inline]] inline void prefetchBody(const void* body)
{
    constexpr std::size_t kShape = 2 * sizeof(btTransform) + 5 * sizeof(btVector3);
    prefetchBytes(body, 0, sizeof(btTransform) + 16);
    prefetchBytes(body, kShape, kShape + 40);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
