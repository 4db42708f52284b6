// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace cullet::test
{
/// Bytes that one operation may read.
inline constexpr std::size_t kOperationBytes = 16;

/// The bytes of one fuzz input, read as decisions.
///
/// An operation reads at most kOperationBytes from its own block, and nextOperation() goes to the next block, so that an
/// input without some blocks is one without some operations. What is beyond the block or the input reads as zero, so the
/// choice for zero should be the plainest one.
class Choices
{
public:
    Choices(const std::uint8_t* data, std::size_t size) : m_data(data), m_size(size) {}

    /// True when no operation is left.
    bool isEmpty() const { return m_block >= m_size; }

    void nextOperation()
    {
        m_block += kOperationBytes;
        m_used = 0;
    }

    std::uint8_t byte()
    {
        const std::size_t index = m_block + m_used;
        if (m_used == kOperationBytes || index >= m_size)
            return 0;
        ++m_used;
        return m_data[index];
    }

    /// Whole number in [0, count), of one byte for up to 256 of them, else of two or four.
    std::uint32_t below(std::uint32_t count)
    {
        if (count <= 1)
            return 0;
        std::uint32_t bits = byte();
        for (std::uint32_t shift = 8; shift < 32 && (count - 1) >> shift != 0; shift += 8)
            bits |= static_cast<std::uint32_t>(byte()) << shift;
        return bits % count;
    }

    /// One of up to 256 values.
    template <class T, std::size_t count>
    T of(const T (&values)[count])
    {
        return values[below(static_cast<std::uint32_t>(count))];
    }

    /// True for `outOf256` of the 256 values of a byte, the highest ones.
    bool chance(std::uint32_t outOf256) { return byte() + outOf256 >= 256; }

    /// A coordinate of two bytes: mostly a multiple of 1/8 in [-16, 16), else a power of two, an earlier coordinate or its
    /// neighbour, or a large one.
    ///
    /// @param mayBeExtreme whether infinities, NaN, the largest and the smallest numbers are among them
    float coordinate(bool mayBeExtreme = false)
    {
        const std::uint8_t kind = byte();
        const std::uint8_t bits = byte();
        const float value = coordinateOf(kind, bits, mayBeExtreme);
        if (std::isfinite(value))
        {
            m_earlier[m_earlierCount % kEarlierCount] = value;
            ++m_earlierCount;
        }
        return value;
    }

private:
    static constexpr std::size_t kEarlierCount = 16;

    float coordinateOf(std::uint8_t kind, std::uint8_t bits, bool mayBeExtreme) const
    {
        const float small = (static_cast<float>(bits ^ 0x80u) - 128.0f) / 8;  // zero for zero
        if (kind < 160)
            return small;
        if (kind < 184)
            return std::ldexp((bits & 1) != 0 ? -1.0f : 1.0f, (bits >> 1) % 64 - 40);
        if (kind < 216)
            return m_earlier[bits % kEarlierCount];
        if (kind < 232)
            return std::nextafter(m_earlier[bits % kEarlierCount], (bits & 16) != 0 ? 1e30f : -1e30f);
        if (kind < 248 || !mayBeExtreme)
            return small * (kind % 2 == 0 ? 64.0f : 65536.0f);
        return extreme(bits);
    }

    static float extreme(std::uint8_t bits)
    {
        using Limits = std::numeric_limits<float>;
        const float values[] = {
            Limits::infinity(), Limits::max(), Limits::quiet_NaN(), 1e18f, 1e-30f, Limits::denorm_min(),
            Limits::max() / 2,  0.0f};
        const float value = values[bits / 2 % 8];
        return (bits & 1) != 0 ? -value : value;
    }

    const std::uint8_t* m_data;
    std::size_t m_size;
    std::size_t m_block = 0;  ///< where the operation begins
    std::size_t m_used = 0;   ///< bytes that it has read
    float m_earlier[kEarlierCount] = {};
    std::size_t m_earlierCount = 0;
};
}  // namespace cullet::test
