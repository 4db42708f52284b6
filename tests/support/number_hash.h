// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/support/fnv1a.h"

#include <cstdint>
#include <cstring>
#include <type_traits>

namespace cullet::test
{
/// A hash of the bits of numbers, of four or eight bytes each.
class NumberHash
{
public:
    template <class T>
    void add(T number)
    {
        std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t> bits;
        static_assert(sizeof(bits) == sizeof(number));
        std::memcpy(&bits, &number, sizeof(bits));
        m_hash.add(bits, sizeof(bits));
    }
    /// The first three components.
    template <class Vector>
    void addVector(const Vector& v)
    {
        for (int i = 0; i < 3; ++i)
            add(v[i]);
    }

    std::uint64_t value() const { return m_hash.value(); }

private:
    Fnv1a m_hash;
};
}  // namespace cullet::test
