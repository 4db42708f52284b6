// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/scenes/fresh_boxes.h"

#include "demos/scenes/splitmix64.h"

#include <algorithm>
#include <cmath>

namespace cullet
{
namespace
{
Aabb cubeAround(float x, float y, float z, float half)
{
    return {{x - half, y - half, z - half}, {x + half, y + half, z + half}};
}

std::vector<Aabb> flatAlong(int axis, std::uint32_t count, std::uint64_t seed)
{
    SplitMix64 random(seed);
    const float side = std::sqrt(16.0f * static_cast<float>(count));
    std::vector<Aabb> boxes(count);
    for (Aabb& box : boxes)
    {
        float centre[3] = {};
        centre[(axis + 1) % 3] = random.uniform(0, side);
        centre[(axis + 2) % 3] = random.uniform(0, side);
        box = cubeAround(centre[0], centre[1], centre[2], 1);
    }
    return boxes;
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
    return flatAlong(0, count, seed);
}

std::vector<Aabb> flatBoxesY(std::uint32_t count, std::uint64_t seed)
{
    return flatAlong(1, count, seed);
}

std::vector<Aabb> flatBoxesZ(std::uint32_t count, std::uint64_t seed)
{
    return flatAlong(2, count, seed);
}

std::vector<Aabb> boxesOnOneLine(std::uint32_t count, std::uint64_t seed)
{
    SplitMix64 random(seed);
    const float length = 2.0f * static_cast<float>(count);
    std::vector<Aabb> boxes(count);
    for (Aabb& box : boxes)
        box = cubeAround(random.uniform(0, length), 0, 0, 1);
    return boxes;
}

std::vector<Aabb> boxesUnderOne(std::uint32_t count, std::uint64_t seed)
{
    std::vector<Aabb> boxes = uniformBoxes(count, seed);
    for (const Aabb& box : boxes)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            boxes.front().min[axis] = std::min(boxes.front().min[axis], box.min[axis]);
            boxes.front().max[axis] = std::max(boxes.front().max[axis], box.max[axis]);
        }
    }
    return boxes;
}
}  // namespace cullet
