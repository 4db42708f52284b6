// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>
#include <vector>

namespace cullet
{
/// Gives back the room of a vector that serves update after update, when it uses little of what a rare large one took.
template <class T, class Allocator>
void trimRoom(std::vector<T, Allocator>& vector)
{
    constexpr std::size_t kSmall = 4096;
    if (vector.capacity() > kSmall && vector.capacity() / 8 > vector.size())
        std::vector<T, Allocator>(vector).swap(vector);
}

/// Makes room for one more element, so that adding it throws nothing. Amortised O(1).
template <class T, class Allocator>
void growRoom(std::vector<T, Allocator>& vector)
{
    if (vector.size() == vector.capacity())
        vector.reserve(vector.empty() ? 1 : 2 * vector.size());
}
}  // namespace cullet
