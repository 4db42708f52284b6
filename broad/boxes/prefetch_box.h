// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"

namespace cullet
{
/// Prefetches a box; one box in four straddles two cache lines.
inline void prefetchBox(const Aabb* box) noexcept
{
    __builtin_prefetch(box->min);
    __builtin_prefetch(box->max + 2);
}
}  // namespace cullet
