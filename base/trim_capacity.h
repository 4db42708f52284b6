// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>

namespace cullet
{
/// Shrinks the capacity of a vector that is reused in every update, when it uses little of what a rare large one
/// needed.
template <class Vector>
void trimCapacity(Vector& vector)
{
    constexpr std::size_t kSmall = 512;
    if (vector.capacity() > kSmall && vector.capacity() / 8 > vector.size())
        Vector(vector).swap(vector);
}

/// Reserves capacity for one more element, so that adding it throws nothing. Amortised O(1).
template <class Vector>
void growCapacity(Vector& vector)
{
    if (vector.size() == vector.capacity())
        vector.reserve(vector.empty() ? 1 : 2 * vector.size());
}
}  // namespace cullet
