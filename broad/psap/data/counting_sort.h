// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/level_plan.h"
#include "cullet/broad/psap/data/pair_lists.h"

#include <cstdint>

/// The steps before the counting-sort search (records.h): each box becomes a record in the bin of its minimum corner.
namespace cullet::psap
{
inline constexpr std::uint32_t kNoBin = 0xffffffffu;

/// Cell coordinate wrapped into [0, count).
CULLET_HOST_DEVICE inline std::uint32_t wrapped(std::int32_t cell, std::uint32_t count)
{
    // Most cells lie within the plan.
    if (static_cast<std::uint32_t>(cell) < count)
        return static_cast<std::uint32_t>(cell);
    const std::int32_t rest = cell % static_cast<std::int32_t>(count);
    return static_cast<std::uint32_t>(rest < 0 ? rest + static_cast<std::int32_t>(count) : rest);
}

CULLET_HOST_DEVICE inline std::uint32_t binAlong(const PlanHead& plan, const PlanLevel& level, float s)
{
    return clampedCell(s, plan.originS, level.inverseBin, level.binCount);
}

/// Cells of a level in serpentine (boustrophedon) order, and the bins of each cell likewise, so that consecutive bins
/// are adjacent in space.
CULLET_HOST_DEVICE inline std::uint32_t serpentineCell(const PlanLevel& level, std::uint32_t u,
                                                       std::uint32_t v)
{
    return v * level.countU + (v % 2 == 0 ? u : level.countU - 1 - u);
}

CULLET_HOST_DEVICE inline std::uint32_t serpentineBin(const PlanLevel& level, std::uint32_t cell,
                                                      std::uint32_t bin)
{
    return cell % 2 == 0 ? bin : level.binCount - 1 - bin;
}

/// Bin of a box, and its rank there.
struct alignas(8) BinRank
{
    std::uint32_t bin;   ///< kNoBin: in no bin
    std::uint32_t rank;  ///< rank in the bin, in the order of arrival
};

/// Totals over all records. Aligned, so that a GPU loads them at once.
struct alignas(16) SortTotals
{
    std::uint32_t unboundedFound;  ///< unbounded boxes found so far; 0 before an update
    std::uint32_t unboundedCount;  ///< boxes on the list of unbounded boxes
    std::uint32_t records;
    std::uint32_t levels;  ///< levels in use; the coarser ones are empty
};

/// Resets counters between the step that finds the bins and the search. One index of a step in between does this,
/// since a separate launch would cost more time.
struct SortCleanup
{
    SortTotals* totals;
    std::uint64_t* pairCount;  ///< set to 0, or null

    CULLET_HOST_DEVICE void operator()() const
    {
        totals->unboundedCount = totals->unboundedFound;
        totals->unboundedFound = 0;
        if (pairCount != nullptr)
            *pairCount = 0;
    }
};

/// Finds the bin of a box.
struct BinFinder
{
    const Aabb* boxes;
    const LevelPlan* plan;
    std::uint32_t* unbounded;  ///< [boxes, out] list of unbounded boxes
    std::uint32_t* unboundedCount;

    /// The part of the plan that most boxes need. Loaded before the box, so that a GPU waits for both loads at once.
    struct Preloaded
    {
        PlanHead plan;
        PlanLevel finest;
    };
    CULLET_HOST_DEVICE Preloaded preload() const { return {*plan, plan->levels[0]}; }

    /// @return kNoBin for invalid boxes, and for boxes without a level, which are appended to the list of unbounded
    ///     boxes
    CULLET_HOST_DEVICE std::uint32_t findBin(std::uint64_t i) const
    {
        const Preloaded preloaded = preload();
        return findBin(preloaded, i, loadBox(boxes, i));
    }
    /// @param box box i
    CULLET_HOST_DEVICE std::uint32_t findBin(const Preloaded& preloaded, std::uint64_t i,
                                             const Aabb& box) const
    {
        const std::uint32_t bin = isValid(box) ? binOf(preloaded, box) : kNoBin;
        if (bin != kNoLevel)
            return bin;
        unbounded[fetchAdd(unboundedCount, 1u)] = static_cast<std::uint32_t>(i);
        return kNoBin;
    }

private:
    static constexpr std::uint32_t kNoLevel = kNoBin - 1;

    CULLET_HOST_DEVICE std::uint32_t binOf(const Preloaded& preloaded, const Aabb& box) const
    {
        const float extent = boundedExtent(box);
        PlanLevel level = preloaded.finest;
        for (std::uint32_t k = 0; k < preloaded.plan.levelCount;)
        {
            if (extent <= level.limit)
                return binOn(preloaded.plan, level, box);
            if (++k < preloaded.plan.levelCount)
                level = plan->levels[k];
        }
        return kNoLevel;
    }

    CULLET_HOST_DEVICE static std::uint32_t binOn(const PlanHead& plan, const PlanLevel& level,
                                                  const Aabb& box)
    {
        const float u = along(box.min, plan.axes.u);
        const float v = along(box.min, plan.axes.v);
        const std::uint32_t bin = binAlong(plan, level, along(box.min, plan.axes.s));
        if (level.isSerpentine != 0)
        {
            const std::uint32_t cell =
                serpentineCell(level, clampedCell(u, plan.originU, level.inverseU, level.countU),
                               clampedCell(v, plan.originV, level.inverseV, level.countV));
            return level.firstBin + cell * level.binCount + serpentineBin(level, cell, bin);
        }
        const std::uint32_t cell =
            wrapped(cellOf(v, plan.originV, level.inverseU), level.countV) * level.countU +
            wrapped(cellOf(u, plan.originU, level.inverseU), level.countU);
        return level.firstBin + cell * level.binCount + bin;
    }
};

/// Step 1: finds the bin of box i and its rank there.
struct CountIntoBins
{
    BinFinder bins;
    BinRank* places;           ///< [boxes, out]
    std::uint32_t* binCounts;  ///< [bins] 0 before the step

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint32_t bin = bins.findBin(i);
        places[i] = {bin, bin == kNoBin ? 0 : fetchAdd(&binCounts[bin], 1u)};
    }
};

/// A box in the layout of the search: 16 bytes that decide most tests, and 16 more.
struct alignas(16) SortRecord
{
    struct alignas(16) Front
    {
        float s0, s1, u0, u1;
    };
    struct alignas(16) Back
    {
        float v0, v1;
        std::uint32_t row;
        std::uint32_t bin;
    };
    Front front;
    Back back;
};

CULLET_HOST_DEVICE inline SortRecord recordOf(const Aabb& box, const Axes& axes, std::uint32_t row,
                                              std::uint32_t bin)
{
    return {{along(box.min, axes.s), along(box.max, axes.s), along(box.min, axes.u), along(box.max, axes.u)},
            {along(box.min, axes.v), along(box.max, axes.v), row, bin}};
}

#ifdef __CUDA_ARCH__
/// isFirst ? a : b, as selects, so that the compiler does not split the store into two divergent ones.
__device__ inline float4 either(bool isFirst, const float4& a, const float4& b)
{
    const auto pick = [isFirst](float x, float y)
    {
        float picked = 0;
        asm("{ .reg .pred p; setp.ne.u32 p, %3, 0; selp.f32 %0, %1, %2, p; }"
            : "=f"(picked)
            : "f"(x), "f"(y), "r"(static_cast<std::uint32_t>(isFirst)));
        return picked;
    };
    return {pick(a.x, b.x), pick(a.y, b.y), pick(a.z, b.z), pick(a.w, b.w)};
}
#endif

/// records[place] = record, except where the place is kNoPlace. On a GPU two lanes write their two records together,
/// a half of each, since a store of half a 32-byte sector costs as much as one of a whole sector.
inline constexpr std::uint32_t kNoPlace = 0xffffffffu;
CULLET_HOST_DEVICE inline void storeRecord(SortRecord* records, std::uint32_t place, const SortRecord& record)
{
#ifdef __CUDA_ARCH__
    constexpr unsigned kAll = 0xffffffffu;
    if (__activemask() == kAll)
    {
        const bool isSecond = threadIdx.x % 2 != 0;
        const auto front = reinterpret_cast<const float4&>(record.front);
        const auto back = reinterpret_cast<const float4&>(record.back);
        const float4 mine = either(isSecond, back, front);
        const float4 given = either(isSecond, front, back);
        const float4 taken = {__shfl_xor_sync(kAll, given.x, 1), __shfl_xor_sync(kAll, given.y, 1),
                              __shfl_xor_sync(kAll, given.z, 1), __shfl_xor_sync(kAll, given.w, 1)};
        const std::uint32_t other = __shfl_xor_sync(kAll, place, 1);
        const std::uint32_t first = isSecond ? other : place;
        const std::uint32_t second = isSecond ? place : other;
        float4* halves = reinterpret_cast<float4*>(records) + (isSecond ? 1 : 0);
        if (first != kNoPlace)
            halves[2 * std::uint64_t{first}] = either(isSecond, taken, mine);
        if (second != kNoPlace)
            halves[2 * std::uint64_t{second}] = either(isSecond, mine, taken);
        return;
    }
#endif
    if (place != kNoPlace)
        records[place] = record;
}

/// A record. On a GPU both halves are loaded before either is used, which the compiler would not do by itself.
CULLET_HOST_DEVICE inline SortRecord loadRecord(const SortRecord* records, std::uint32_t place)
{
#ifdef __CUDA_ARCH__
    const auto load = [](const void* half)
    {
        float4 numbers = {};
        asm volatile("ld.global.v4.f32 {%0, %1, %2, %3}, [%4];"
                     : "=f"(numbers.x), "=f"(numbers.y), "=f"(numbers.z), "=f"(numbers.w)
                     : "l"(half));
        return numbers;
    };
    const float4 front = load(&records[place].front);
    const float4 back = load(&records[place].back);
    return {{front.x, front.y, front.z, front.w},
            {back.x, back.y, __float_as_uint(back.z), __float_as_uint(back.w)}};
#else
    return records[place];
#endif
}

/// Step 3: writes the record of box i to its place.
struct ScatterToBins
{
    const Aabb* boxes;
    const LevelPlan* plan;
    const BinRank* places;
    const std::uint32_t* binStarts;  ///< [binCapacity + 1] exclusive scan of the counts
    std::uint64_t binCapacity;
    SortRecord* records;  ///< [boxes, out]
    SortCleanup cleanup;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        if (i == 0)
            total();
        const BinRank place = places[i];
        storeRecord(records, place.bin == kNoBin ? kNoPlace : binStarts[place.bin] + place.rank,
                    recordOf(loadBox(boxes, i), plan->axes, static_cast<std::uint32_t>(i), place.bin));
    }

private:
    CULLET_HOST_DEVICE void total() const
    {
        cleanup();
        const std::uint32_t count = binStarts[binCapacity];
        std::uint32_t levels = 0;
        while (levels < plan->levelCount && binStarts[plan->levels[levels].firstBin] < count)
            ++levels;
        cleanup.totals->records = count;
        cleanup.totals->levels = levels;
    }
};
}  // namespace cullet::psap
