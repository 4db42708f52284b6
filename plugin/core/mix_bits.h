// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <cstring>

namespace cullet
{
/// For hashes: a number of whose bits all depend on all bits of two others. As in Wang Yi's wyhash (public domain).
inline std::uint64_t mixBits(std::uint64_t a, std::uint64_t b) noexcept
{
    __extension__ using Wide = unsigned __int128;
    const Wide product = Wide(a ^ 0x9e3779b97f4a7c15) * (b ^ 0xa0761d6478bd642f);
    return static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64);
}

/// The bits of a number of up to eight bytes.
template <class Number>
std::uint64_t bitsOf(Number number) noexcept
{
    static_assert(sizeof(Number) <= sizeof(std::uint64_t), "a larger number");
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof(number));
    return bits;
}
}  // namespace cullet
