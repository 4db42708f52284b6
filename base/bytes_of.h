// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet
{
/// Bytes of the memory that vectors hold, used or not.
template <class... Vectors>
std::uint64_t bytesOf(const Vectors&... vectors)
{
    return (std::uint64_t{0} + ... + (vectors.capacity() * sizeof(typename Vectors::value_type)));
}
}  // namespace cullet
