// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Finds the cells that boxes touch; compiled for each instruction set. Every width takes the same steps, each rounded
// once, so that all find the same cells.
#pragma once

#include "cullet/broad/grid/columns/cell_bounds.h"
#include "cullet/broad/grid/columns/column_soa.h"

#include <cstring>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

namespace cullet
{
namespace
{
#if defined(__AVX2__)
inline __m256 joined(Float4 first, Float4 second)
{
    __m128 low;
    __m128 high;
    std::memcpy(&low, &first, sizeof low);
    std::memcpy(&high, &second, sizeof high);
    return _mm256_set_m128(high, low);
}

/// cellsOfFaces() of the faces of two boxes.
inline __m256i cellsOfTwo(__m256 faces, const CellBounds& cellBounds)
{
    const CellFactors factors(cellBounds);
    const __m256 isBelow = _mm256_cmp_ps(faces, _mm256_setzero_ps(), _CMP_LT_OQ);
    const __m256 factor =
        _mm256_blendv_ps(joined(factors.above, factors.above), joined(factors.below, factors.below), isBelow);
    __m256 cell = _mm256_add_ps(_mm256_mul_ps(faces, factor), joined(factors.offset, factors.offset));
    // The second operand is the result where one is NaN, as in a comparison.
    cell = _mm256_max_ps(cell, _mm256_set1_ps(-kFarthestCell));
    cell = _mm256_min_ps(_mm256_set1_ps(kFarthestCell), cell);
    const __m256i truncated = _mm256_cvttps_epi32(cell);
    const __m256 isUpwards = _mm256_cmp_ps(_mm256_cvtepi32_ps(truncated), cell, _CMP_GT_OQ);
    return _mm256_add_epi32(truncated, _mm256_castps_si256(isUpwards));
}
#endif

/// Appends located boxes to a block, and the indices of outliers to a list of their own.
struct LocatedSink
{
    LocatedBox* block;
    std::uint32_t* outliers;
    LocatedCounts counts = {0, 0};

    void put(std::uint32_t index, std::uint32_t proxyRow, const Int4& cells, bool isPlain)
    {
        static_assert(sizeof cells == sizeof block->cells);
        std::memcpy(&block[counts.plain].cells, &cells, sizeof cells);
        block[counts.plain].proxyRow = proxyRow;
        block[counts.plain].level = 0;
        outliers[counts.outliers] = index;
        counts.plain += isPlain ? 1u : 0u;
        counts.outliers += isPlain ? 0u : 1u;
    }
};

template <int kSweepAxis>
void locateOne(const LocateSource& source, const CellBounds& cellBounds, std::uint32_t index,
               LocatedSink& sink)
{
    const std::uint32_t proxyRow = source.proxyRow(index);
    const Float4 outward = Float4{-1.0f, 1.0f, -1.0f, 1.0f} * source.grow;
    const Aabb& box = source.boxes[proxyRow];
    const Int4 cells = cellsOfFaces(BoxFaces<kSweepAxis>(box).tile + outward, cellBounds);
    const Float4 extents = extentsOf(box);
    const Int4 first = CULLET_SHUFFLE(cells, cells, 0, 0, 2, 2);
    sink.put(index, proxyRow, cells,
             isTrueInAll((extents >= 0.0f) & (extents <= source.largestExtent) &
                         (cells < first + source.manyCells)));
}

#if defined(__AVX2__)
template <int kSweepAxis>
void locateTwo(const LocateSource& source, const CellBounds& cellBounds, std::uint32_t index,
               LocatedSink& sink)
{
    const std::uint32_t first = source.proxyRow(index);
    const std::uint32_t second = source.proxyRow(index + 1);
    const __m256 outward =
        _mm256_mul_ps(_mm256_setr_ps(-1, 1, -1, 1, -1, 1, -1, 1), _mm256_set1_ps(source.grow));
    const Aabb& a = source.boxes[first];
    const Aabb& b = source.boxes[second];
    const __m256 tiles = joined(BoxFaces<kSweepAxis>(a).tile, BoxFaces<kSweepAxis>(b).tile);
    const __m256i cells = cellsOfTwo(_mm256_add_ps(tiles, outward), cellBounds);
    const __m256 extents = joined(extentsOf(a), extentsOf(b));
    const __m256 isBounded =
        _mm256_and_ps(_mm256_cmp_ps(extents, _mm256_setzero_ps(), _CMP_GE_OQ),
                      _mm256_cmp_ps(extents, _mm256_set1_ps(source.largestExtent), _CMP_LE_OQ));
    const __m256i firsts = _mm256_shuffle_epi32(cells, 0xa0);
    const __m256i isFew =
        _mm256_cmpgt_epi32(_mm256_add_epi32(firsts, _mm256_set1_epi32(source.manyCells)), cells);
    const int isPlain = _mm256_movemask_ps(_mm256_and_ps(isBounded, _mm256_castsi256_ps(isFew)));
    Int4 both[2];
    std::memcpy(both, &cells, sizeof both);
    sink.put(index, first, both[0], (isPlain & 0xf) == 0xf);
    sink.put(index + 1, second, both[1], (isPlain & 0xf0) == 0xf0);
}
#endif

template <int kSweepAxis>
LocatedCounts locateAlong(const LocateSource& source, std::uint32_t begin, std::uint32_t end,
                          LocatedBox* block, std::uint32_t* outliers)
{
    const CellBounds cellBounds = {source.cellSkin, source.inverseWidth};
    LocatedSink sink = {block, outliers};
    std::uint32_t i = begin;
#if defined(__AVX2__)
    for (; i + 1 < end; i += 2)
        locateTwo<kSweepAxis>(source, cellBounds, i, sink);
#endif
    for (; i < end; ++i)
        locateOne<kSweepAxis>(source, cellBounds, i, sink);
    return sink.counts;
}

LocatedCounts locateBoxes(const LocateSource& source, std::uint32_t begin, std::uint32_t end,
                          LocatedBox* block, std::uint32_t* outliers)
{
    if (source.sweepAxis == 0)
        return locateAlong<0>(source, begin, end, block, outliers);
    if (source.sweepAxis == 1)
        return locateAlong<1>(source, begin, end, block, outliers);
    return locateAlong<2>(source, begin, end, block, outliers);
}
}  // namespace
}  // namespace cullet
