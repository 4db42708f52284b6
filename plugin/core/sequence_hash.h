// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/mix_bits.h"
#include "cullet/plugin/core/precision.h"

#include <LinearMath/btTransform.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A hash of a sequence; a sum, so that processors need not wait for one product after the other.
class SequenceHash
{
public:
    void add(std::uint64_t a, std::uint64_t b) noexcept
    {
        m_place += 0x9e3779b97f4a7c15;
        m_sum += mixBits(a ^ m_place, b);
    }
    void add(const btVector3& v) noexcept { add(mixBits(bitsOf(v.x()), bitsOf(v.y())), bitsOf(v.z())); }
    void add(const btTransform& at) noexcept
    {
        for (int row = 0; row < 3; ++row)
            add(at.getBasis()[row]);
        add(at.getOrigin());
    }

    /// Never 0.
    std::uint64_t value() const noexcept { return m_sum | 1; }

private:
    std::uint64_t m_sum = 0, m_place = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
