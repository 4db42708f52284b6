// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"

#include <cstdint>
#include <vector>

namespace cullet
{
// The boxes of one frame, different for each seed: the workloads on which GPU broad phases are compared.

/// W1: spheres of radius 1, constant density, about one pair per body.
std::vector<Aabb> uniformBoxes(std::uint32_t count, std::uint64_t seed);

/// W2: sides log-uniform from 0.1 to 100, just under five pairs per body.
std::vector<Aabb> boxesOfManySizes(std::uint32_t count, std::uint64_t seed);

/// W3: a heap of spheres, dense below, 7.6 pairs per body.
std::vector<Aabb> heapOfBoxes(std::uint32_t count, std::uint64_t seed);

/// All boxes have the same extent along x, y or z; half a pair per body.
std::vector<Aabb> flatBoxes(std::uint32_t count, std::uint64_t seed);
std::vector<Aabb> flatBoxesY(std::uint32_t count, std::uint64_t seed);
std::vector<Aabb> flatBoxesZ(std::uint32_t count, std::uint64_t seed);

/// All boxes are on a line along x, about one pair per body.
std::vector<Aabb> boxesOnOneLine(std::uint32_t count, std::uint64_t seed);

/// W1, but the first box covers all others.
std::vector<Aabb> boxesUnderOne(std::uint32_t count, std::uint64_t seed);

/// A scene whose boxes are new in each frame.
struct FreshScene
{
    const char* name;
    std::uint32_t bodies;
    std::vector<Aabb> (*make)(std::uint32_t count, std::uint64_t seed);
};
}  // namespace cullet
