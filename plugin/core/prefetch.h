// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <LinearMath/btTransform.h>

#include <cstddef>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Asks for bytes [from, to) of an object, multiples of 16 and the object aligned to that; always inline, or it is a call for
/// two instructions.
[[gnu::always_inline]] inline void prefetchBytes(const void* object, std::size_t from, std::size_t to)
{
    const auto* bytes = static_cast<const char*>(object);
    __builtin_prefetch(bytes + from);
    for (std::size_t at = from + 64; at + 16 < to; at += 64)
        __builtin_prefetch(bytes + at);
    __builtin_prefetch(bytes + to - 1);
}

/// Transform, shape and state of a btCollisionObject: the first comes first in it, the others behind the second transform
/// and five vectors.
[[gnu::always_inline]] inline void prefetchBody(const void* body)
{
    constexpr std::size_t kShape = 2 * sizeof(btTransform) + 5 * sizeof(btVector3);
    prefetchBytes(body, 0, sizeof(btTransform) + 16);
    prefetchBytes(body, kShape, kShape + 40);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
