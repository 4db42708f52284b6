// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>

namespace cullet
{
/// Gives back the room of a vector that serves update after update, when it uses little of what a rare large one took.
template <class Vector>
void trimRoom(Vector& vector)
{
    constexpr std::size_t kSmall = 4096;
    if (vector.capacity() > kSmall && vector.capacity() / 8 > vector.size())
        Vector(vector).swap(vector);
}

/// Makes room for one more element, so that adding it throws nothing. Amortised O(1).
template <class Vector>
void growRoom(Vector& vector)
{
    if (vector.size() == vector.capacity())
        vector.reserve(vector.empty() ? 1 : 2 * vector.size());
}
}  // namespace cullet
