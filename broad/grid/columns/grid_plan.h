// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"

#include <array>
#include <cstdint>
#include <cstring>

namespace cullet
{
/// Resolution of a size as Lesson 04 (docs/references.md) defines it, Res(A) = i <=> a < Size / s_i <= b with
/// a = 0.5, b = 1 and cell sizes s that are powers of two: the exponent e with 2^(e-1) < size <= 2^e.
///
/// The interval is half-open, so that every size has exactly one resolution. Zero and denormals have the lowest,
/// -126; infinity and NaN have more than 127.
inline std::int32_t octaveOf(float size) noexcept
{
    std::uint32_t bits;
    std::memcpy(&bits, &size, sizeof bits);
    return static_cast<std::int32_t>(((bits != 0 ? bits : 1u) - 1u) >> 23) - 126;
}

/// Octaves that the grid distinguishes. Smaller sizes count in the lowest one; larger boxes are unbounded.
inline constexpr std::int32_t kLowestOctave = -40;
inline constexpr std::int32_t kHighestOctave = 50;
inline constexpr std::int32_t kOctaveCount = kHighestOctave - kLowestOctave + 1;
inline constexpr std::uint32_t kMaxLevels = 8;

/// Sizes of boxes, per octave of the larger tiled extent; collected in one pass over the boxes.
struct SizeHistogram
{
    struct Bin
    {
        std::uint32_t count = 0;
        double tileSum = 0;   ///< sum of the mean tiled extents
        double sweepSum = 0;  ///< sum of the extents along the sweep axis
    };
    std::array<Bin, kOctaveCount> bins{};
    std::uint32_t weight = 1;  ///< boxes that each sampled one stands for

    void add(const SizeHistogram& other);
    std::uint32_t count() const;
};

/// How the world is divided: the sweep axis, and the width of the columns per level, finest level first.
///
/// Any plan gives the same pairs; a bad one only costs time.
struct GridPlan
{
    int sweepAxis = 0;
    int tileAxisY = 1;
    int tileAxisZ = 2;
    std::uint32_t levelCount = 1;
    std::array<float, kMaxLevels> width{{1.0f}};
    std::array<float, kMaxLevels> inverseWidth{{1.0f}};
    float narrowest = 1;  ///< the least of the widths: a level of few boxes may be wider than a coarser one
    std::array<std::uint8_t, kOctaveCount> levelOfOctave{};
    double predictedCandidates = 0;
    // Expected cost of filling and scanning, nanoseconds of a 2023 server core: of the plan, with one level, and with
    // a level for each octave of sizes.
    double cost = 0;
    double oneLevelCost = 0;
    double allLevelsCost = 0;
};

/// Cells are at least so many skins wide: a box that fits its cells touches few of them with its skin.
inline constexpr float kSkinsPerCell = 8;

/// Choices that override the cost model.
struct GridPlanLimits
{
    float cellScale = 0;       ///< > 0: width of every level in units of its largest boxes
    std::uint32_t levels = 0;  ///< > 0: number of levels, if there are as many octaves of sizes
    float leastWidth = 0;      ///< of every level
};

/// Robust extents of the box centres (5 % to 95 % quantile, scaled up) from a deterministic sample.
void measureSpans(const Aabb* boxes, const std::uint32_t* proxyRows, std::uint32_t count, float span[3]);

/// Chooses axis, levels and column widths from sizes, spans and `density`, a factor learnt from earlier frames by
/// which the scene is more crowded than evenly spread boxes would be.
GridPlan makeGridPlan(const SizeHistogram& sizes, const float span[3], int sweepAxis, double density,
                      const GridPlanLimits& limits);

/// The axis of the largest span; `previous` stays unless another one is clearly larger (thesis: highest variance).
int chooseSweepAxis(const float span[3], int previous);
}  // namespace cullet
