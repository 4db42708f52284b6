// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>
#include <cstdint>

namespace cullet::test
{
/// FNV-1a, 64 bits.
class Fnv1a
{
public:
    /// Adds the lowest bytes of a word, low byte first.
    void add(std::uint64_t word, std::size_t bytes)
    {
        for (std::size_t i = 0; i < bytes; ++i)
            m_hash = (m_hash ^ (word >> 8 * i & 0xffu)) * 1099511628211ull;
    }

    std::uint64_t value() const { return m_hash; }

private:
    std::uint64_t m_hash = 14695981039346656037ull;
};
}  // namespace cullet::test
