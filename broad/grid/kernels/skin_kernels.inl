// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Finds boxes outside their skins, and pairs that may have changed; compiled for each instruction set, after
// column_kernels.inl. Boxes and pairs that seem to have changed are tested again, so that all widths give the same
// result.
#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/broad/grid/columns/column_soa.h"

namespace cullet
{
namespace
{
// The smallest number of boxes that fill whole vectors.
constexpr std::uint32_t kSkinBlock = (Lanes::kWidth + 1) / 2;
constexpr std::uint32_t kSkinVectors = 6 * kSkinBlock / Lanes::kWidth;

// The boxes of pairs are prefetched so many iterations early.
constexpr std::uint32_t kPrefetchedPairs = 32;

/// Whether no face of a block of boxes moved farther than the skin; false for infinite faces.
inline bool isBlockInside(const float* now, const float* then, Lanes::Value skin)
{
    const auto isNear = [&](std::uint32_t vector)
    {
        const Lanes::Value motion = Lanes::subtract(Lanes::load(now + vector * Lanes::kWidth),
                                                    Lanes::load(then + vector * Lanes::kWidth));
        return Lanes::le(Lanes::larger(motion, Lanes::subtract(Lanes::broadcast(0.0f), motion)), skin);
    };
    Lanes::Mask inside = isNear(0);
    for (std::uint32_t vector = 1; vector < kSkinVectors; ++vector)
        inside = Lanes::both(inside, isNear(vector));
    return Lanes::bits(inside) == Lanes::kFull;
}

std::uint32_t findBoxesOutsideSkin(const SkinSource& source, std::uint32_t begin, std::uint32_t end,
                                   std::uint32_t* outside)
{
    const Lanes::Value skin = Lanes::broadcast(source.skin);
    std::uint32_t count = 0;
    for (std::uint32_t row = begin; row < end;)
    {
        const bool isBlock = end - row >= kSkinBlock;
        const std::uint32_t next = isBlock ? row + kSkinBlock : row + 1;
        if (isBlock && isBlockInside(source.boxes[row].min, source.reference[row].min, skin))
        {
            row = next;
            continue;
        }
        for (; row < next; ++row)
        {
            outside[count] = row;
            count += isInsideSkin(source.boxes[row], source.reference[row], source.skin) ? 0u : 1u;
        }
    }
    return count;
}

std::uint32_t findChangedPairs(const PairStateSource& source, std::uint32_t begin, std::uint32_t end,
                               std::uint32_t* changed)
{
    std::uint32_t count = 0;
    for (std::uint32_t i = begin; i < end; ++i)
    {
        const RowPair ahead = source.pairs[std::min(i + kPrefetchedPairs, source.count - 1)];
        prefetchBox(source.boxes + ahead.a);
        prefetchBox(source.boxes + ahead.b);
        const RowPair pair = source.pairs[i];
        const std::uint8_t state = source.states[i];
        const Aabb& a = source.boxes[pair.a];
        const Aabb& b = source.boxes[pair.b];
        const float limit = source.limits[state];
        const bool isSeparated = isTrueInAny((gapsFromTo(a, b) > limit) | (gapsFromTo(b, a) > limit));
        changed[count] = i;
        count += isSeparated != (state == source.candidate) ? 1u : 0u;
    }
    return count;
}
}  // namespace
}  // namespace cullet
