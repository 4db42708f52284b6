// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/fresh_boxes.h"

#include "cullet/demos/scenes/splitmix64.h"

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

/// @param place place(random) makes the next box
template <class Place>
std::vector<Aabb> boxesAt(std::uint32_t count, std::uint64_t seed, const Place& place)
{
    SplitMix64 random(seed);
    std::vector<Aabb> boxes(count);
    for (Aabb& box : boxes)
        box = place(random);
    return boxes;
}

std::vector<Aabb> flatAlong(int axis, std::uint32_t count, std::uint64_t seed)
{
    const float side = std::sqrt(16.0f * static_cast<float>(count));
    return boxesAt(count, seed,
                   [&](SplitMix64& random)
                   {
                       float centre[3] = {};
                       centre[(axis + 1) % 3] = random.uniform(0, side);
                       centre[(axis + 2) % 3] = random.uniform(0, side);
                       return cubeAround(centre[0], centre[1], centre[2], 1);
                   });
}

/// @param half half(random) is called after place(random)
template <class Half>
std::vector<Aabb> scattered(std::uint32_t count, std::uint64_t seed, float volume, const Half& half)
{
    const float side = std::cbrt(volume * static_cast<float>(count));
    return boxesAt(count, seed,
                   [&](SplitMix64& random)
                   {
                       const float x = random.uniform(0, side), y = random.uniform(0, side),
                                   z = random.uniform(0, side);
                       return cubeAround(x, y, z, half(random));
                   });
}
}  // namespace

std::vector<Aabb> uniformBoxes(std::uint32_t count, std::uint64_t seed)
{
    return scattered(count, seed, 32, [](SplitMix64&) { return 1.0f; });
}

std::vector<Aabb> boxesOfManySizes(std::uint32_t count, std::uint64_t seed)
{
    return scattered(count, seed, 16457,
                     [](SplitMix64& random) { return 0.5f * std::pow(10.0f, random.uniform(-1, 2)); });
}

std::vector<Aabb> heapOfBoxes(std::uint32_t count, std::uint64_t seed)
{
    const float side = std::sqrt(0.1055f * static_cast<float>(count));
    return boxesAt(count, seed,
                   [&](SplitMix64& random)
                   {
                       const float x = random.uniform(0, side), z = random.uniform(0, side);
                       return cubeAround(x, -20 * std::log(1 - random.uniform(0, 1)), z, 1);
                   });
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
    const float length = 2.0f * static_cast<float>(count);
    return boxesAt(count, seed,
                   [&](SplitMix64& random) { return cubeAround(random.uniform(0, length), 0, 0, 1); });
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
