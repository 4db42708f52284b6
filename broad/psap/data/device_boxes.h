// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/host_device.h"
#include "cullet/broad/row_pair.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

/// Boxes in an executor's memory: how they are loaded and stored there, and how far they have moved.
namespace cullet::psap
{
inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// The box whose comparisons are all false. It stands for empty boxes on the device, so that isValid() need not be
/// called.
CULLET_HOST_DEVICE inline Aabb emptyBox()
{
    return {{kNan, kNan, kNan}, {kNan, kNan, kNan}};
}

/// Raises a non-negative float to at least `value`. The bits of non-negative floats are ordered as the floats are.
CULLET_HOST_DEVICE inline void atomicMaxFloat(std::uint32_t* bits, float value)
{
#ifdef __CUDA_ARCH__
    // Most values change nothing; a load first avoids contention of atomics at one address.
    if (*static_cast<volatile std::uint32_t*>(bits) < bitsOf(value))
        atomicMax(bits, bitsOf(value));
#else
    std::uint32_t seen = __atomic_load_n(bits, __ATOMIC_RELAXED);
    while (seen < bitsOf(value) && !__atomic_compare_exchange_n(bits, &seen, bitsOf(value), false,
                                                                __ATOMIC_RELAXED, __ATOMIC_RELAXED))
    {
    }
#endif
}

/// Stores a number where concurrent indices store the same value.
template <class T>
CULLET_HOST_DEVICE inline void storeSameValue(T* number, T value)
{
#ifdef __CUDA_ARCH__
    *number = value;
#else
    __atomic_store_n(number, value, __ATOMIC_RELAXED);
#endif
}

CULLET_HOST_DEVICE inline float floatOf(std::uint32_t bits)
{
    float value = 0;
    memcpy(&value, &bits, sizeof(value));
    return value;
}

/// boxes[row], on the GPU in three loads instead of six: the number of loads bounds the search.
///
/// @pre `boxes` is aligned to 8 bytes there, as memory of cudaMalloc() is
CULLET_HOST_DEVICE inline Aabb loadBox(const Aabb* boxes, std::uint64_t row)
{
#ifdef __CUDA_ARCH__
    const float2* words = reinterpret_cast<const float2*>(boxes) + 3 * row;
    const float2 a = words[0];
    const float2 b = words[1];
    const float2 c = words[2];
    return {{a.x, a.y, b.x}, {b.y, c.x, c.y}};
#else
    return boxes[row];
#endif
}

/// boxes[row] = box, in three stores on the GPU.
CULLET_HOST_DEVICE inline void storeBox(Aabb* boxes, std::uint64_t row, const Aabb& box)
{
#ifdef __CUDA_ARCH__
    float2* words = reinterpret_cast<float2*>(boxes) + 3 * row;
    words[0] = {box.min[0], box.min[1]};
    words[1] = {box.min[2], box.max[0]};
    words[2] = {box.max[1], box.max[2]};
#else
    boxes[row] = box;
#endif
}

/// A box in one 32-byte sector of a GPU's memory. The same code tests either half of two boxes.
struct alignas(16) BoxHalf
{
    /// Along two axes; in the second half one of them has the same values in all boxes.
    float low0, high0, low1, high1;
};
struct alignas(32) AlignedBox
{
    BoxHalf xy, z;
};

CULLET_HOST_DEVICE inline bool meets(const BoxHalf& a, const BoxHalf& b)
{
    return (a.low0 <= b.high0) & (b.low0 <= a.high0) & (a.low1 <= b.high1) & (b.low1 <= a.high1);
}

/// Half k of the boxes, in one load on a GPU.
CULLET_HOST_DEVICE inline BoxHalf loadHalf(const AlignedBox* boxes, std::uint64_t k)
{
#ifdef __CUDA_ARCH__
    const float4 half = reinterpret_cast<const float4*>(boxes)[k];
    return {half.x, half.y, half.z, half.w};
#else
    return k % 2 == 0 ? boxes[k / 2].xy : boxes[k / 2].z;
#endif
}

/// boxes[row]. On a GPU in three loads of two numbers: loads of four need consecutive registers, which searches lack.
CULLET_HOST_DEVICE inline Aabb loadBox(const AlignedBox* boxes, std::uint64_t row)
{
#ifdef __CUDA_ARCH__
    const float2* axes = reinterpret_cast<const float2*>(boxes) + 4 * row;
    const float2 x = axes[0];
    const float2 y = axes[1];
    const float2 z = axes[2];
    return {{x.x, y.x, z.x}, {x.y, y.y, z.y}};
#else
    const AlignedBox& box = boxes[row];
    return {{box.xy.low0, box.xy.low1, box.z.low0}, {box.xy.high0, box.xy.high1, box.z.high0}};
#endif
}
/// boxes[row] = box.
///
/// @param more stored in the unused part of the box, not negative
CULLET_HOST_DEVICE inline void storeAligned(AlignedBox* boxes, std::uint64_t row, const Aabb& box, float more)
{
#ifdef __CUDA_ARCH__
    float4* halves = reinterpret_cast<float4*>(boxes) + 2 * row;
    halves[0] = {box.min[0], box.max[0], box.min[1], box.max[1]};
    halves[1] = {box.min[2], box.max[2], 0, more};  // whole sectors
#else
    boxes[row] = {{box.min[0], box.max[0], box.min[1], box.max[1]}, {box.min[2], box.max[2], 0, more}};
#endif
}
/// copies[row] = box, or emptyBox() where the box is invalid.
CULLET_HOST_DEVICE inline void storeCopy(AlignedBox* copies, std::uint64_t row, const Aabb& box)
{
    storeAligned(copies, row, isValid(box) ? box : emptyBox(), 0);
}

/// The length that two intervals share; negative when they are separated.
CULLET_HOST_DEVICE inline float sharedLength(float a0, float a1, float b0, float b1)
{
    return (a1 < b1 ? a1 : b1) - (a0 > b0 ? a0 : b0);
}

/// The length that two boxes share on the axis where it is shortest; negative when they are separated.
CULLET_HOST_DEVICE inline float overlapOf(const Aabb& a, const Aabb& b)
{
    float shortest = kInfinity;
    for (int axis = 0; axis < 3; ++axis)
    {
        const float shared = sharedLength(a.min[axis], a.max[axis], b.min[axis], b.max[axis]);
        shortest = shared < shortest ? shared : shortest;
    }
    return shortest;
}

/// overlapOf() for one half of two boxes; any negative number where they are separated or empty.
///
/// @param isSecond the half contains one axis only
CULLET_HOST_DEVICE inline float overlapOf(const BoxHalf& a, const BoxHalf& b, bool isSecond)
{
    if (!meets(a, b))
        return -1;
    const float first = sharedLength(a.low0, a.high0, b.low0, b.high0);
    const float second = sharedLength(a.low1, a.high1, b.low1, b.high1);
    return isSecond || first < second ? first : second;
}

/// By how much the boxes of a pair overlap; negative where they do not, or where `isNeeded` is false. On a GPU all
/// lanes of a warp call this together: two lanes load the boxes of both their pairs, half each, so that each sector
/// is loaded once.
CULLET_HOST_DEVICE inline float overlapByWarp(const AlignedBox* boxes, RowPair pair, bool isNeeded)
{
#ifdef __CUDA_ARCH__
    constexpr unsigned kAll = 0xffffffffu;
    const bool isSecond = threadIdx.x % 2 != 0;
    const RowPair other = {__shfl_xor_sync(kAll, pair.a, 1), __shfl_xor_sync(kAll, pair.b, 1)};
    const bool isOtherNeeded = __shfl_xor_sync(kAll, isNeeded ? 1 : 0, 1) != 0;
    const auto overlapOfHalves = [&](RowPair asked, bool isWanted)
    {
        const std::uint64_t half = isSecond ? 1 : 0;
        return isWanted ? overlapOf(loadHalf(boxes, 2 * std::uint64_t{asked.a} + half),
                                    loadHalf(boxes, 2 * std::uint64_t{asked.b} + half), isSecond)
                        : -1.0f;
    };
    const float first = overlapOfHalves(isSecond ? other : pair, isSecond ? isOtherNeeded : isNeeded);
    const float second = overlapOfHalves(isSecond ? pair : other, isSecond ? isNeeded : isOtherNeeded);
    const float mine = isSecond ? second : first;
    const float others = __shfl_xor_sync(kAll, isSecond ? first : second, 1);
    return mine < others ? mine : others;
#else
    const auto half = [&](std::uint64_t k)
    {
        return overlapOf(loadHalf(boxes, 2 * std::uint64_t{pair.a} + k),
                         loadHalf(boxes, 2 * std::uint64_t{pair.b} + k), k == 1);
    };
    if (!isNeeded)
        return -1;
    const float first = half(0);
    const float second = half(1);
    return first < second ? first : second;
#endif
}

/// How far a coordinate has moved. An infinite coordinate that stays has not moved.
CULLET_HOST_DEVICE inline float distanceMoved(float x, float before)
{
    return x == before ? 0.0f : fabsf(x - before);
}

/// The longest distance that a face of a box has moved; infinite where exactly one of the two boxes is empty.
CULLET_HOST_DEVICE inline float distanceMoved(const Aabb& box, const Aabb& before)
{
    float longest = 0;
    for (int axis = 0; axis < 3; ++axis)
    {
        const float low = distanceMoved(box.min[axis], before.min[axis]);
        const float high = distanceMoved(box.max[axis], before.max[axis]);
        const float distance = low > high ? low : high;
        if (!(distance <= kInfinity))  // NaN
            return kInfinity;
        longest = distance > longest ? distance : longest;
    }
    return longest;
}

/// distanceMoved() from a stored box, which is emptyBox() where the box was invalid.
CULLET_HOST_DEVICE inline float distanceFromStored(const Aabb& before, const Aabb& box)
{
    const bool wasEmpty = before.min[0] != before.min[0];
    return wasEmpty && !isValid(box) ? 0.0f : distanceMoved(box, before);
}

/// Copies of the boxes of this update and of the previous one.
struct BoxCopies
{
    AlignedBox* now;        ///< [boxes, out] emptyBox() for invalid boxes; null: no copies
    const AlignedBox* old;  ///< [oldCount]
    std::uint64_t oldCount;
    std::uint32_t* motion;  ///< as BoxHistory::motion; 0 before the step

    /// @return how far the box has moved
    CULLET_HOST_DEVICE float keep(std::uint64_t i, const Aabb& box) const
    {
        storeCopy(now, i, box);
        const float distance = distanceFromOld(i, box);
        atomicMaxFloat(motion, distance);
        return distance;
    }
    CULLET_HOST_DEVICE float distanceFromOld(std::uint64_t i, const Aabb& box) const
    {
        return i < oldCount ? distanceFromStored(loadBox(old, i), box) : kInfinity;
    }
};

/// The boxes of this update and of the previous one, by row.
struct RowBoxes
{
    const Aabb* now;
    const Aabb* old;

    CULLET_HOST_DEVICE float distanceFromOld(std::uint64_t i, const Aabb& box) const
    {
        return distanceFromStored(loadBox(old, i), box);
    }
};

/// Converts aligned box i to an Aabb.
struct UnalignBox
{
    const AlignedBox* from;
    Aabb* to;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const { storeBox(to, i, loadBox(from, i)); }
};
}  // namespace cullet::psap
