// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <array>
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

    /// Three of between(), from the last to the first: in the order in which GCC evaluates arguments, which
    /// recorded hashes rely on.
    std::array<float, 3> point(float low, float high)
    {
        const float z = between(low, high), y = between(low, high), x = between(low, high);
        return {x, y, z};
    }

    bool chance(float probability) { return unit() < probability; }

    /// About log-uniform in [2^low, 2^high), without the math library's pow(), whose last bit differs.
    float logUniform(int low, int high)
    {
        const int exponent = low + static_cast<int>(below(static_cast<std::uint32_t>(high - low)));
        return std::ldexp(1.0f + unit(), exponent);
    }

private:
    std::mt19937 m_engine;
};
}  // namespace cullet::test
