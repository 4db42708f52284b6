// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/scenes/fresh_boxes.h"

#include "demos/scenes/splitmix64.h"

#include <cmath>

namespace cullet
{
namespace
{
Aabb cubeAround(float x, float y, float z, float half)
{
    return {{x - half, y - half, z - half}, {x + half, y + half, z + half}};
}
}  // namespace

std::vector<Aabb> uniformBoxes(std::uint32_t count, std::uint64_t seed)
{
    SplitMix64 random(seed);
    const float side = std::cbrt(32.0f * static_cast<float>(count));
    std::vector<Aabb> boxes(count);
    for (Aabb& box : boxes)
    {
        const float x = random.uniform(0, side), y = random.uniform(0, side), z = random.uniform(0, side);
        box = cubeAround(x, y, z, 1);
    }
    return boxes;
}

std::vector<Aabb> boxesOfManySizes(std::uint32_t count, std::uint64_t seed)
{
    SplitMix64 random(seed);
    const float side = std::cbrt(16457.0f * static_cast<float>(count));
    std::vector<Aabb> boxes(count);
    for (Aabb& box : boxes)
    {
        const float x = random.uniform(0, side), y = random.uniform(0, side), z = random.uniform(0, side);
        box = cubeAround(x, y, z, 0.5f * std::pow(10.0f, random.uniform(-1, 2)));
    }
    return boxes;
}

std::vector<Aabb> heapOfBoxes(std::uint32_t count, std::uint64_t seed)
{
    SplitMix64 random(seed);
    const float side = std::sqrt(0.1055f * static_cast<float>(count));
    std::vector<Aabb> boxes(count);
    for (Aabb& box : boxes)
    {
        const float x = random.uniform(0, side), z = random.uniform(0, side);
        box = cubeAround(x, -20 * std::log(1 - random.uniform(0, 1)), z, 1);
    }
    return boxes;
}

std::vector<Aabb> flatBoxes(std::uint32_t count, std::uint64_t seed)
{
    SplitMix64 random(seed);
    const float side = std::sqrt(16.0f * static_cast<float>(count));
    std::vector<Aabb> boxes(count);
    for (Aabb& box : boxes)
    {
        const float y = random.uniform(0, side), z = random.uniform(0, side);
        box = cubeAround(0, y, z, 1);
    }
    return boxes;
}
}  // namespace cullet
