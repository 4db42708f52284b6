// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace cullet::test
{
/// Random numbers that are equal with every standard library, unlike the distributions of <random>.
class Random
{
public:
    explicit Random(std::uint32_t seed) : m_engine(seed) {}

    std::uint32_t bits() { return static_cast<std::uint32_t>(m_engine()); }

    /// Whole number in [0, count); the bias of the modulo is irrelevant for tests.
    std::uint32_t below(std::uint32_t count) { return bits() % count; }

    /// [0, 1) in steps of 2^-24.
    float unit() { return std::ldexp(static_cast<float>(bits() >> 8), -24); }

    /// [low, high), rounded like any float product and sum.
    float between(float low, float high) { return low + (high - low) * unit(); }

    bool chance(float probability) { return unit() < probability; }

    /// About log-uniform in [2^low, 2^high), without the math library's pow(), whose last bit differs.
    float logUniform(int low, int high)
    {
        return std::ldexp(1.0f + unit(),
                          low + static_cast<int>(below(static_cast<std::uint32_t>(high - low))));
    }

private:
    std::mt19937 m_engine;
};
}  // namespace cullet::test
