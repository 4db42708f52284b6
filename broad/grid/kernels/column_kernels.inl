// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Body of the column kernels; each including source is compiled for another instruction set. Only comparisons and
// single subtractions are computed, so every width finds the same pairs.
#include "cullet/base/exclusive_sum.h"
#include "cullet/base/vector16.h"
#include "cullet/broad/grid/columns/cell_bounds.h"
#include "cullet/broad/grid/columns/column_soa.h"

#include <algorithm>
#include <cstring>
#include <limits>

#if defined(__AVX__)
#include <immintrin.h>
#endif

namespace cullet
{
#include "cullet/base/simd_lanes.inl"

namespace
{
/// Appends the hits that own their pair, with its gap, to the buffer, which has room.
#if defined(__AVX512F__)
/// Without a branch: whether a vector has hits is hard to predict. Only the lanes of hits are read, since another
/// thread may write behind the end of the column.
inline void append(std::uint32_t hits, Lanes::Value gap, TaggedRow proxyRow, const TaggedRow* proxyRows,
                   PairBuffer& out)
{
    const __m512i first = _mm512_set1_epi32(static_cast<int>(proxyRow));
    const auto found = static_cast<Lanes::Mask>(hits);
    const __m512i second = _mm512_maskz_loadu_epi32(found, proxyRows);
    const Lanes::Mask owned = _mm512_mask_cmpge_epu32_mask(found, _mm512_or_si512(first, second),
                                                           _mm512_set1_epi32(static_cast<int>(kOwnsPair)));
    _mm512_storeu_si512(out.first + out.count, first);
    _mm512_storeu_si512(out.second + out.count, _mm512_maskz_compress_epi32(owned, second));
    _mm512_storeu_ps(out.gap + out.count, _mm512_maskz_compress_ps(owned, gap));
    out.count += static_cast<std::uint32_t>(__builtin_popcount(owned));
}
#else
inline void append(std::uint32_t hits, Lanes::Value gap, TaggedRow proxyRow, const TaggedRow* proxyRows,
                   PairBuffer& out)
{
    if (hits == 0)
        return;
    float gaps[Lanes::kWidth];
    Lanes::store(gaps, gap);
    do
    {
        const auto lane = static_cast<std::uint32_t>(__builtin_ctz(hits));
        hits &= hits - 1;
        out.first[out.count] = proxyRow;
        out.second[out.count] = proxyRows[lane];
        out.gap[out.count] = gaps[lane];
        // Unconditional store, conditional advance: duplicates over cells are about a quarter of all hits, which a
        // branch would mispredict.
        out.count += (proxyRow | proxyRows[lane]) >= kOwnsPair ? 1u : 0u;
    } while (hits != 0);
}
#endif

/// Box of one entry, broadcast to all lanes.
struct Query
{
    Lanes::Value x0, x1, y0, y1, z0, z1;
    float bound;
};

inline Query makeQuery(const ColumnSoa& column, std::uint32_t i)
{
    return {Lanes::broadcast(column.x0[i]),
            Lanes::broadcast(column.x1[i]),
            Lanes::broadcast(column.y0[i]),
            Lanes::broadcast(column.y1[i]),
            Lanes::broadcast(column.z0[i]),
            Lanes::broadcast(column.z1[i]),
            column.bounds != nullptr ? column.bounds[i] : 0.0f};
}

/// Lanes whose gap is to be reported.
template <bool kBounded>
inline std::uint32_t hitsOf(Lanes::Value gap, const Query& query, const float* bounds, const PairBuffer& out)
{
    if (kBounded)
    {
        const Lanes::Value size = Lanes::larger(gap, Lanes::subtract(Lanes::broadcast(0.0f), gap));
        const Lanes::Value own = Lanes::broadcast(-query.bound);
        return Lanes::bits(Lanes::le(size, Lanes::subtract(Lanes::load(bounds), own)));
    }
    return Lanes::bits(Lanes::le(gap, Lanes::broadcast(out.maxGap))) &
           ~Lanes::bits(Lanes::le(gap, Lanes::broadcast(out.minGap)));
}

/// Tests the entries of `column` from `begin` on, up to the first that begins farther beyond the end of the query than
/// the largest gap to be reported.
template <bool kBounded>
inline void sweep(const Query& query, TaggedRow proxyRow, const ColumnSoa& column, std::uint32_t begin,
                  PairBuffer& out)
{
    const Lanes::Value maxGap = Lanes::broadcast(kBounded ? query.bound + 0.5f * out.maxGap : out.maxGap);
    for (std::uint32_t j = begin;; j += Lanes::kWidth)
    {
        const Lanes::Value ahead = Lanes::subtract(Lanes::load(column.x0 + j), query.x1);
        Lanes::Value gap = Lanes::larger(ahead, Lanes::subtract(query.x0, Lanes::load(column.x1 + j)));
        gap = Lanes::larger(gap, Lanes::larger(Lanes::subtract(Lanes::load(column.y0 + j), query.y1),
                                               Lanes::subtract(query.y0, Lanes::load(column.y1 + j))));
        gap = Lanes::larger(gap, Lanes::larger(Lanes::subtract(Lanes::load(column.z0 + j), query.z1),
                                               Lanes::subtract(query.z0, Lanes::load(column.z1 + j))));
        const std::uint32_t inside = Lanes::bits(Lanes::le(ahead, maxGap));
        // Only the lanes before the first one outside count: behind the sentinel another column may follow.
        const std::uint32_t before = (~inside & (inside + 1)) - 1;
        const std::uint32_t hits =
            hitsOf<kBounded>(gap, query, kBounded ? column.bounds + j : nullptr, out) & before;
        out.ensureRoom();
        append(hits, gap, proxyRow, column.proxyRow + j, out);
        if (inside != Lanes::kFull)
        {
            out.tests += j + Lanes::kWidth - begin;
            return;
        }
    }
}

template <bool kBounded>
void scanSelfBy(const ColumnSoa& column, PairBuffer& out)
{
    for (std::uint32_t i = 0; i + 1 < column.count; ++i)
        sweep<kBounded>(makeQuery(column, i), column.proxyRow[i], column, i + 1, out);
}

template <bool kBounded>
void scanCrossBy(const ColumnSoa& a, const ColumnSoa& b, PairBuffer& out)
{
    std::uint32_t i = 0;
    std::uint32_t j = 0;
    // Merge by x0: the entry that begins first sweeps over the entries of the other column that begin inside it.
    while (i < a.count && j < b.count)
    {
        if (a.x0[i] <= b.x0[j])
        {
            sweep<kBounded>(makeQuery(a, i), a.proxyRow[i], b, j, out);
            ++i;
        }
        else
        {
            sweep<kBounded>(makeQuery(b, j), b.proxyRow[j], a, i, out);
            ++j;
        }
    }
}

void scanSelf(const ColumnSoa& column, PairBuffer& out)
{
    if (column.bounds != nullptr)
        scanSelfBy<true>(column, out);
    else
        scanSelfBy<false>(column, out);
}

void scanCross(const ColumnSoa& a, const ColumnSoa& b, PairBuffer& out)
{
    if (a.bounds != nullptr)
        scanCrossBy<true>(a, b, out);
    else
        scanCrossBy<false>(a, b, out);
}

void scanOne(const ColumnSoa& query, std::uint32_t index, const ColumnSoa& column, std::uint32_t begin,
             PairBuffer& out)
{
    sweep<false>(makeQuery(query, index), query.proxyRow[index], column, begin, out);
}

/// A local type, so that the linker does not merge std::sort with that of another instruction set.
struct BeginsBefore
{
    template <class T>
    bool operator()(const T& a, const T& b) const
    {
        return a.x0 < b.x0;
    }
};

constexpr std::uint32_t kFewEntries = 32;  // sorted by insertion
constexpr std::uint32_t kMaxBuckets = 4096;
constexpr int kMaxSortDepth = 4;

inline void sortByInsertion(SortKey* keys, std::uint32_t count)
{
    for (std::uint32_t i = 1; i < count; ++i)
    {
        const SortKey key = keys[i];
        std::uint32_t j = i;
        for (; j > 0 && keys[j - 1].x0 > key.x0; --j)
            keys[j] = keys[j - 1];
        keys[j] = key;
    }
}

/// Evenly spaced buckets between two x0; the outer ones also hold everything beyond. Rounding is monotone at every
/// step, so that the order of buckets never contradicts the order of x0.
struct SortBuckets
{
    float lowest;
    float scale;
    std::uint32_t count = 2 * kFewEntries;

    SortBuckets(float low, float high, std::uint32_t size) : lowest(low)
    {
        while (count < size && count < kMaxBuckets)
            count *= 2;
        scale = static_cast<float>(count) / (high - low);
    }

    /// False where all x0 are equal, or too close together or too far apart for floats.
    bool areUseful() const { return scale > 0 && scale < std::numeric_limits<float>::infinity(); }

    std::uint32_t of(float x0) const
    {
        const float slot = (x0 - lowest) * scale;
        // NaN, the result of an unusable scale, becomes 0.
        const float notBelow = slot > 0.0f ? slot : 0.0f;
        const float last = static_cast<float>(count - 1);
        return static_cast<std::uint32_t>(static_cast<std::int32_t>(notBelow < last ? notBelow : last));
    }
};

/// Buckets between the lowest and the highest key.
inline SortBuckets bucketsOf(const SortKey* keys, std::uint32_t count)
{
    float lowest = std::numeric_limits<float>::infinity();
    float highest = -lowest;
    for (std::uint32_t i = 0; i < count; ++i)
    {
        lowest = keys[i].x0 < lowest ? keys[i].x0 : lowest;
        highest = keys[i].x0 > highest ? keys[i].x0 : highest;
    }
    return {lowest, highest, count};
}

/// Sorts `from` into `to` by x0, and uses `from` as scratch: by buckets, full buckets recursively, and in the end by
/// insertion.
void bucketSort(SortKey* from, SortKey* to, std::uint32_t count, int depth)
{
    const SortBuckets buckets = bucketsOf(from, count);
    if (depth == 0 || !buckets.areUseful())
    {
        std::memcpy(to, from, count * sizeof *to);
        std::sort(to, to + count, BeginsBefore());
        return;
    }
    std::uint32_t offsets[kMaxBuckets];
    std::memset(offsets, 0, buckets.count * sizeof *offsets);
    for (std::uint32_t i = 0; i < count; ++i)
        ++offsets[buckets.of(from[i].x0)];
    const std::uint32_t most = exclusiveSum(offsets, buckets.count);
    for (std::uint32_t i = 0; i < count; ++i)
        to[offsets[buckets.of(from[i].x0)]++] = from[i];
    // Each offset is now the end of its bucket.
    for (std::uint32_t slot = 0, begin = 0; slot < buckets.count && most > kFewEntries;
         begin = offsets[slot++])
    {
        const std::uint32_t size = offsets[slot] - begin;
        if (size <= kFewEntries)
            continue;
        std::memcpy(from + begin, to + begin, size * sizeof *to);
        bucketSort(from + begin, to + begin, size, depth - 1);
    }
    sortByInsertion(to, count);
}

/// Flags of a box in a cell; false when it does not touch the cell.
inline bool findFlags(Float4 tile, Float4 low, Float4 high, TaggedRow& flags)
{
    // Lanes 0 and 2 hold minima, 1 and 3 maxima.
    const Int4 isNotBelow = tile >= low;
    const Int4 isInside = ((tile < high) & Int4{-1, 0, -1, 0}) | (isNotBelow & Int4{0, -1, 0, -1});
    const Int4 begins = isNotBelow & Int4{static_cast<std::int32_t>(kStartsHereY), 0,
                                          static_cast<std::int32_t>(kStartsHereZ), 0};
    flags = static_cast<TaggedRow>(begins[0] | begins[2]);
    return isTrueInAll(isInside);
}

// Boxes are prefetched so many iterations early.
constexpr std::uint32_t kPrefetch = 64;

/// Appends the boxes [begin, end) of the source to `to` and returns the new end. Without kBucketed they are sorted by
/// x0, by insertion unless too many are out of order. With kBucketed they stay unsorted; the bucket of each is stored
/// and counted.
template <int kSweepAxis, bool kEdges, bool kBucketed>
ColumnEntry* gatherRange(const ColumnSource& source, std::uint32_t begin, std::uint32_t end, ColumnEntry* to,
                         const SortBuckets& buckets, std::uint32_t* counts)
{
    const Float4 outward = Float4{-1.0f, 1.0f, -1.0f, 1.0f} * source.grow;
    const Float4 low = kEdges ? loadFloat4(source.edges->low) : Float4{};
    const Float4 high = kEdges ? loadFloat4(source.edges->high) : Float4{};
    ColumnEntry* const first = to;
    std::uint32_t movesLeft = 8 * (end - begin);
    for (std::uint32_t i = begin; i < end; ++i)
    {
        const TaggedRow ahead = source.proxyRows[std::min(i + kPrefetch, source.count - 1)];
        prefetchBox(source.boxes + (ahead & kRowMask));
        TaggedRow proxyRow = source.proxyRows[i];
        const BoxFaces<kSweepAxis> faces(source.boxes[proxyRow & kRowMask]);
        if (kEdges)
        {
            TaggedRow flags;
            if (!findFlags(faces.tile, low, high, flags))
                continue;
            proxyRow = (proxyRow & kRowMask) | flags;
        }
        const Float4 tile = faces.tile + outward;
        const Float4 sweepFaces = faces.sweep + outward;
        const float x0 = sweepFaces[0];
        ColumnEntry* slot = to++;
        for (; !kBucketed && slot != first && slot[-1].x0 > x0 && movesLeft != 0; --slot, --movesLeft)
            slot[0] = slot[-1];
        std::memcpy(slot->tile, &tile, sizeof tile);
        slot->x0 = x0;
        slot->x1 = sweepFaces[1];
        slot->proxyRow = proxyRow;
        if (kBucketed)
            ++counts[slot->slot = buckets.of(x0)];
    }
    if (!kBucketed && movesLeft == 0)
        std::sort(first, to, BeginsBefore());
    return to;
}

/// Merges the sorted [middle, end) into the sorted [first, middle); there is room for a copy of the former behind the
/// end.
inline void mergeFew(ColumnEntry* first, ColumnEntry* middle, ColumnEntry* end)
{
    ColumnEntry* few = std::copy(middle, end, end);
    for (ColumnEntry* to = end; few != end;)
        *--to = middle != first && middle[-1].x0 > few[-1].x0 ? *--middle : *--few;
}

inline void store(float* to, Float4 value)
{
    std::memcpy(to, &value, sizeof value);
}

/// Transposes four half entries.
struct Transposed4
{
    Float4 c0, c1, c2, c3;

    Transposed4(const float* first, const float* second, const float* third, const float* fourth)
    {
        const Float4 a = loadFloat4(first);
        const Float4 b = loadFloat4(second);
        const Float4 c = loadFloat4(third);
        const Float4 d = loadFloat4(fourth);
        const Float4 lowAb = CULLET_SHUFFLE(a, b, 0, 4, 1, 5);
        const Float4 lowCd = CULLET_SHUFFLE(c, d, 0, 4, 1, 5);
        const Float4 highAb = CULLET_SHUFFLE(a, b, 2, 6, 3, 7);
        const Float4 highCd = CULLET_SHUFFLE(c, d, 2, 6, 3, 7);
        c0 = CULLET_SHUFFLE(lowAb, lowCd, 0, 1, 4, 5);
        c1 = CULLET_SHUFFLE(lowAb, lowCd, 2, 3, 6, 7);
        c2 = CULLET_SHUFFLE(highAb, highCd, 0, 1, 4, 5);
        c3 = CULLET_SHUFFLE(highAb, highCd, 2, 3, 6, 7);
    }
};

/// Lays sorted boxes out for the scans. Writes whole vectors: up to three entries more than count + 1.
///
/// @param entryAt index in the column -> ColumnEntry, also for up to three indices behind the last one
template <class EntryAt>
void layOut(ColumnSoa& column, std::uint32_t count, const EntryAt& entryAt)
{
    for (std::uint32_t i = 0; i < count; i += 4)
    {
        const ColumnEntry& a = entryAt(i);
        const ColumnEntry& b = entryAt(i + 1);
        const ColumnEntry& c = entryAt(i + 2);
        const ColumnEntry& d = entryAt(i + 3);
        const Transposed4 tile(a.tile, b.tile, c.tile, d.tile);
        const Transposed4 sweepTransposed(&a.x0, &b.x0, &c.x0, &d.x0);
        store(column.y0 + i, tile.c0);
        store(column.y1 + i, tile.c1);
        store(column.z0 + i, tile.c2);
        store(column.z1 + i, tile.c3);
        store(column.x0 + i, sweepTransposed.c0);
        store(column.x1 + i, sweepTransposed.c1);
        std::memcpy(column.proxyRow + i, &sweepTransposed.c2, sizeof sweepTransposed.c2);
    }
    column.x0[count] = std::numeric_limits<float>::infinity();
    column.count = count;
}

/// Builds a column from boxes in any order, by buckets over the usual range of all columns; where one of them gets
/// too full, by buckets over the range of this column. Keys are sorted; no ColumnEntry is moved.
template <int kSweepAxis, bool kEdges>
void buildUnsorted(const ColumnSource& source, const ColumnScratch& scratch, ColumnSoa& column)
{
    const SortBuckets buckets(source.sweepLow, source.sweepHigh, source.count);
    std::uint32_t offsets[kMaxBuckets];
    std::memset(offsets, 0, buckets.count * sizeof *offsets);
    ColumnEntry* const entries = scratch.entries;
    SortKey* const keys = scratch.keys;
    const ColumnEntry* const end =
        gatherRange<kSweepAxis, kEdges, true>(source, 0, source.count, entries, buckets, offsets);
    const auto count = static_cast<std::uint32_t>(end - entries);
    if (exclusiveSum(offsets, buckets.count) > kFewEntries)
    {
        for (std::uint32_t i = 0; i < count; ++i)
            keys[count + i] = {entries[i].x0, i};
        bucketSort(keys + count, keys, count, kMaxSortDepth);
    }
    else
    {
        for (std::uint32_t i = 0; i < count; ++i)
            keys[offsets[entries[i].slot]++] = {entries[i].x0, i};
        sortByInsertion(keys, count);
    }
    // layOut() reads whole vectors behind the last key.
    for (std::uint32_t i = count; i < count + 3; ++i)
        keys[i].index = 0;
    layOut(column, count, [&](std::uint32_t i) -> const ColumnEntry& { return entries[keys[i].index]; });
}

template <int kSweepAxis, bool kEdges>
void buildAlong(const ColumnSource& source, const ColumnScratch& scratch, ColumnSoa& column)
{
    if (source.sortedCount == 0 && source.count > kFewEntries)
    {
        buildUnsorted<kSweepAxis, kEdges>(source, scratch, column);
        return;
    }
    const SortBuckets none(0, 0, 0);
    ColumnEntry* const entries = scratch.entries;
    ColumnEntry* const middle =
        gatherRange<kSweepAxis, kEdges, false>(source, 0, source.sortedCount, entries, none, nullptr);
    ColumnEntry* const end = gatherRange<kSweepAxis, kEdges, false>(source, source.sortedCount, source.count,
                                                                    middle, none, nullptr);
    mergeFew(entries, middle, end);
    layOut(column, static_cast<std::uint32_t>(end - entries),
           [&](std::uint32_t i) -> const ColumnEntry& { return entries[i]; });
}

void buildColumn(const ColumnSource& source, const ColumnScratch& scratch, ColumnSoa& column)
{
    using Build = void (*)(const ColumnSource&, const ColumnScratch&, ColumnSoa&);
    static constexpr Build kBuild[3][2] = {{buildAlong<0, false>, buildAlong<0, true>},
                                           {buildAlong<1, false>, buildAlong<1, true>},
                                           {buildAlong<2, false>, buildAlong<2, true>}};
    kBuild[source.sweepAxis][source.edges != nullptr](source, scratch, column);
}
}  // namespace
}  // namespace cullet
