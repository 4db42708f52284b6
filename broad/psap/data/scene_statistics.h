// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"

#include <cmath>
#include <cstdint>
#include <limits>

/// Positions and sizes of the boxes, from which axis and cells are chosen. They never affect which pairs are found.
namespace cullet::psap
{
/// Boxes longer than this have no cells and are left out of the statistics (Bullet's planes reach 1e18 or 1e30).
inline constexpr float kUnboundedExtent = 1125899906842624.0f;  // 2^50

inline constexpr std::uint32_t kOctaves = 128;

/// The longest side of a valid box, or infinity when it is unbounded.
CULLET_HOST_DEVICE inline float boundedExtent(const Aabb& box)
{
    float longest = 0;
    for (int axis = 0; axis < 3; ++axis)
    {
        const float extent = box.max[axis] - box.min[axis];
        if (!(extent <= kUnboundedExtent))  // NaN, from equal infinities, counts as unbounded
            return kInfinity;
        longest = extent > longest ? extent : longest;
    }
    return longest;
}

/// Size class of a box; sizes double from one class to the next.
CULLET_HOST_DEVICE inline std::uint32_t octaveOf(float extent)
{
    const std::int32_t octave = static_cast<std::int32_t>(bitsOf(extent) >> 23) - 127 + 64;
    return octave < 0 ? 0u : octave > 127 ? 127u : static_cast<std::uint32_t>(octave);
}

/// Number of boxes and longest side in each size class.
struct SizeClasses
{
    std::uint32_t count[kOctaves];
    std::uint32_t largestBits[kOctaves];  ///< longest side in the class, for atomicMaxFloat()
};

/// Sums over bounded boxes.
struct Moments
{
    double sum[3];        ///< of the centres
    double sumSquare[3];  ///< of the centres
    double extent[3];     ///< of the sides
    float low[3];         ///< least minimum
    float high[3];        ///< greatest minimum
    std::uint64_t count;
    std::uint64_t others;  ///< bounded boxes outside the window; the other members leave them out

    CULLET_HOST_DEVICE void reset()
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            sum[axis] = sumSquare[axis] = extent[axis] = 0;
            low[axis] = kInfinity;
            high[axis] = -kInfinity;
        }
        count = others = 0;
    }

    CULLET_HOST_DEVICE void add(const Aabb& box)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            const double centre =
                0.5 * (static_cast<double>(box.min[axis]) + static_cast<double>(box.max[axis]));
            sum[axis] += centre;
            sumSquare[axis] += centre * centre;
            extent[axis] += static_cast<double>(box.max[axis]) - static_cast<double>(box.min[axis]);
            low[axis] = box.min[axis] < low[axis] ? box.min[axis] : low[axis];
            high[axis] = box.min[axis] > high[axis] ? box.min[axis] : high[axis];
        }
        ++count;
    }

    CULLET_HOST_DEVICE void add(const Moments& other)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            sum[axis] += other.sum[axis];
            sumSquare[axis] += other.sumSquare[axis];
            extent[axis] += other.extent[axis];
            low[axis] = other.low[axis] < low[axis] ? other.low[axis] : low[axis];
            high[axis] = other.high[axis] > high[axis] ? other.high[axis] : high[axis];
        }
        count += other.count;
        others += other.others;
    }

    CULLET_HOST_DEVICE double variance(std::uint32_t axis) const
    {
        const double n = count == 0 ? 1.0 : static_cast<double>(count);
        const double mean = sum[axis] / n;
        return sumSquare[axis] / n - mean * mean;
    }

    /// Rounding may leave a variance below 0.
    CULLET_HOST_DEVICE double deviation(std::uint32_t axis) const
    {
        const double square = variance(axis);
        return square > 0 ? sqrt(square) : 0.0;
    }
};

/// The region that contains most boxes. Without it, one box far away would make all others look like one point.
struct CentreWindow
{
    double low[3], high[3];

    CULLET_HOST_DEVICE bool contains(const Aabb& box) const
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            const double centre = 0.5 * (static_cast<double>(box.min[axis]) + box.max[axis]);
            if (centre < low[axis] || centre > high[axis])
                return false;
        }
        return true;
    }
};

/// Computes the window from sums over an earlier one, or a window that contains everything. One index.
struct FindWindow
{
    static constexpr double kDeviations = 8;

    const Moments* moments;  ///< null: there are none yet
    CentreWindow* window;

    CULLET_HOST_DEVICE void operator()(std::uint64_t) const
    {
        // Where all boxes have left the window, the next one contains everything.
        const bool isKnown = moments != nullptr && moments->count > moments->others;
        for (std::uint32_t axis = 0; axis < 3; ++axis)
        {
            const double mean = isKnown ? moments->sum[axis] / static_cast<double>(moments->count) : 0;
            const double reach = isKnown ? kDeviations * moments->deviation(axis) + width(axis)
                                         : static_cast<double>(kInfinity);
            window->low[axis] = mean - reach;
            window->high[axis] = mean + reach;
        }
    }

private:
    /// Mean width of a box: all may be at one place.
    CULLET_HOST_DEVICE double width(std::uint32_t axis) const
    {
        return moments->extent[axis] / static_cast<double>(moments->count);
    }
};

/// Sums every `stride * parts`-th box into one of `parts` partial sums.
///
/// Which boxes go into which part, and in which order, depends on the counts alone, so that every executor gets the
/// same bits.
struct SumBoxes
{
    const Aabb* boxes;
    std::uint64_t count;
    std::uint64_t parts;
    std::uint64_t stride;        ///< 1: all boxes; otherwise every `stride`-th
    const CentreWindow* window;  ///< null: all boxes count
    Moments* moments;            ///< [parts]
    SizeClasses* sizes;          ///< 0 before; includes boxes outside the window

    CULLET_HOST_DEVICE void operator()(std::uint64_t part) const
    {
        Moments sums;
        sums.reset();
        // A run of boxes of one class costs one atomic.
        std::uint32_t octave = 0;
        std::uint32_t run = 0;
        float largest = 0;
        const std::uint64_t step = parts * stride;
        Aabb next = part * stride < count ? loadBox(boxes, part * stride) : Aabb{};
        for (std::uint64_t i = part * stride; i < count; i += step)
        {
            const Aabb box = next;
            if (i + step < count)
                next = loadBox(boxes, i + step);  // loaded while this one is added
            const float extent = boundedExtent(box);
            if (!isValid(box) || !(extent <= kUnboundedExtent))
                continue;
            if (window == nullptr || window->contains(box))
                sums.add(box);
            else
                ++sums.others;
            if (octaveOf(extent) != octave)
            {
                flush(octave, run, largest);
                octave = octaveOf(extent);
                run = 0;
                largest = 0;
            }
            ++run;
            largest = extent > largest ? extent : largest;
        }
        flush(octave, run, largest);
        moments[part] = sums;
    }

private:
    CULLET_HOST_DEVICE void flush(std::uint32_t octave, std::uint32_t run, float largest) const
    {
        if (run == 0)
            return;
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 800
        // Lanes with boxes of one class share one atomic: atomics at one address are served one after the other.
        const unsigned lanes = __match_any_sync(__activemask(), octave);
        run = __reduce_add_sync(lanes, run);
        largest = floatOf(__reduce_max_sync(lanes, bitsOf(largest)));
        if (threadIdx.x % 32 != static_cast<unsigned>(__ffs(static_cast<int>(lanes)) - 1))
            return;
#endif
        fetchAdd(&sizes->count[octave], run);
        atomicMaxFloat(&sizes->largestBits[octave], largest);
    }
};

/// Adds up to kFanIn partial sums.
struct SumMoments
{
    static constexpr std::uint64_t kFanIn = 32;

    const Moments* parts;
    std::uint64_t count;
    Moments* sums;  ///< [count / kFanIn, rounded up]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        Moments sum = parts[i * kFanIn];
        for (std::uint64_t k = i * kFanIn + 1; k < (i + 1) * kFanIn && k < count; ++k)
            sum.add(parts[k]);
        sums[i] = sum;
    }
};

/// The three axes, the sweep axis first.
struct Axes
{
    std::uint32_t s, u, v;
};

/// vector[axis] for an axis known only at run time: indexing would place the vector in local memory on a GPU.
CULLET_HOST_DEVICE inline float along(const float (&vector)[3], std::uint32_t axis)
{
    return axis == 0 ? vector[0] : axis == 1 ? vector[1] : vector[2];
}

/// PsapOptions::axis, with the axis that the seed chooses for PsapAxis::Random.
inline PsapAxis sweepAxis(const PsapOptions& options)
{
    constexpr PsapAxis kAxes[3] = {PsapAxis::X, PsapAxis::Y, PsapAxis::Z};
    return options.axis == PsapAxis::Random ? kAxes[(options.seed * 2654435761u >> 16) % 3] : options.axis;
}

/// @param choice of sweepAxis()
CULLET_HOST_DEVICE inline Axes chooseAxes(const Moments& moments, PsapAxis choice)
{
    std::uint32_t s = 0;
    if (choice == PsapAxis::Y)
        s = 1;
    if (choice == PsapAxis::Z)
        s = 2;
    if (choice == PsapAxis::Variance)
    {
        // `>` keeps the first of equal axes.
        for (std::uint32_t axis = 1; axis < 3; ++axis)
            s = moments.variance(axis) > moments.variance(s) ? axis : s;
    }
    return {s, (s + 1) % 3, (s + 2) % 3};
}

/// Integer cell coordinate; monotone in `value`, whatever the rounding.
///
/// Limited to +-2^22: up to there rounding moves a coordinate by less than a cell.
CULLET_HOST_DEVICE inline std::int32_t cellOf(float value, float origin, float inverse)
{
    const float scaled = (value - origin) * inverse;
    constexpr std::int32_t kLimit = 1 << 22;
#ifdef __CUDA_ARCH__
    const std::int32_t cell = __float2int_rd(scaled);  // saturates by itself; NaN gives 0
    return min(max(cell, -kLimit), kLimit);
#else
    // NaN, from an infinity times zero, maps to 0.
    if (scaled != scaled)
        return 0;
    constexpr float kFloatLimit = static_cast<float>(kLimit);
    return static_cast<std::int32_t>(
        floorf(scaled > -kFloatLimit ? (scaled < kFloatLimit ? scaled : kFloatLimit) : -kFloatLimit));
#endif
}

/// Cell along one axis, clamped. Monotone, so that boxes outside the planned scene are still found exactly.
CULLET_HOST_DEVICE inline std::uint32_t clampedCell(float value, float origin, float inverse,
                                                    std::uint32_t count)
{
    const std::int32_t last = static_cast<std::int32_t>(count) - 1;
#ifdef __CUDA_ARCH__
    const std::int32_t cell = __float2int_rd((value - origin) * inverse);  // saturates by itself
#else
    const std::int32_t cell = cellOf(value, origin, inverse);
#endif
    return static_cast<std::uint32_t>(cell < 0 ? 0 : cell > last ? last : cell);
}
}  // namespace cullet::psap
