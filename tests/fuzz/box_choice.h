// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/tests/fuzz/choices.h"

#include <cmath>
#include <cstdint>
#include <utility>

namespace cullet::test
{
/// Changes the sizes, of three bytes.
inline void resize(Choices& choices, Aabb& box)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        const std::uint8_t bits = choices.byte();
        const float side =
            bits < 160 ? static_cast<float>(bits) / 32 : std::ldexp(1.0f, static_cast<int>(bits % 32) - 20);
        box.max[axis] = bits == 255 ? box.min[axis] - 1 : box.min[axis] + side;
    }
}

/// Of six bytes for the corner and three for the sizes.
inline Aabb chosenBox(Choices& choices)
{
    Aabb box;
    for (float& low : box.min)
        low = choices.coordinate();
    resize(choices, box);
    return box;
}

inline Aabb chosenStrangeBox(Choices& choices)
{
    Aabb box;
    const bool isSorted = !choices.chance(64);
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] = choices.coordinate(true);
        box.max[axis] = choices.coordinate(true);
        // Else seven of eight boxes would be empty.
        if (isSorted && box.min[axis] > box.max[axis])
            std::swap(box.min[axis], box.max[axis]);
    }
    return box;
}

inline Filter chosenFilter(Choices& choices)
{
    const std::uint8_t bits = choices.byte();
    if (bits < 128)
        return {1, -1};
    const std::int32_t without = ~(1 << (bits >> 3 & 3));
    return {1 << (bits & 3), (bits & 4) != 0 ? without : bits >> 3 & 15};
}

inline void moveAlong(Aabb& box, int axis, float way)
{
    box.min[axis] += way;
    box.max[axis] += way;
}

/// Numbers that look random, for operations on many boxes.
class Noise
{
public:
    explicit Noise(std::uint32_t seed) : m_state(seed) {}

    /// In [-reach, reach).
    float upTo(float reach)
    {
        m_state = m_state * 1664525u + 1013904223u;
        return (static_cast<float>(m_state >> 8) / 8388608.0f - 1.0f) * reach;
    }

    void move(Aabb& box, float reach)
    {
        for (int axis = 0; axis < 3; ++axis)
            moveAlong(box, axis, upTo(reach));
    }

private:
    std::uint32_t m_state;
};
}  // namespace cullet::test
