// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet
{
/// One step of the mixing function alone: a hash of one integer.
inline std::uint64_t splitMix(std::uint64_t value) noexcept
{
    value += 0x9e3779b97f4a7c15ull;
    value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9ull;
    value = (value ^ (value >> 27)) * 0x94d049bb133111ebull;
    return value ^ (value >> 31);
}

/// Random numbers that are equal on every machine and with every standard library (the distributions of <random> are
/// not): Steele, Lea and Flood 2014, "Fast Splittable Pseudorandom Number Generators".
class SplitMix64
{
public:
    explicit SplitMix64(std::uint64_t seed) noexcept : m_state(seed) {}

    std::uint64_t next() noexcept
    {
        const std::uint64_t value = splitMix(m_state);
        m_state += 0x9e3779b97f4a7c15ull;
        return value;
    }

    /// Uniform in [low, high), on a raster of 2^24 steps.
    float uniform(float low, float high) noexcept
    {
        return low + (high - low) * (static_cast<float>(next() >> 40) * 0x1p-24f);
    }

    /// Uniform in [0, count). The bias is below count / 2^64.
    std::uint64_t below(std::uint64_t count) noexcept { return next() % count; }

private:
    std::uint64_t m_state;
};
}  // namespace cullet
