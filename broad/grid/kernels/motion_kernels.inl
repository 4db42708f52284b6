// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Measures how boxes moved since the last scan, and whether they stayed in their cells; compiled for each instruction
// set. Every width takes the same steps, each rounded once, so that all give the same result.
#include "cullet/broad/grid/columns/cell_bounds.h"
#include "cullet/broad/grid/columns/column_soa.h"
#include "cullet/broad/grid/kernels/cell_kernels.inl"

#include <algorithm>
#include <cstring>

namespace cullet
{
namespace
{
#if defined(__AVX2__)
/// The current and the previous box, each in one register.
template <int kSweepAxis>
class MovedBox
{
public:
    MovedBox(const Aabb& now, const Aabb& then) : m_now(facesOf(now)), m_then(facesOf(then)) {}

    /// Largest motion of a face, as bits: floats without sign are ordered like their bits. Infinity and NaN, the
    /// motion of boxes that were or are empty, are the largest.
    std::int32_t motionBits() const
    {
        const __m256i size = _mm256_and_si256(_mm256_castps_si256(_mm256_sub_ps(m_now, m_then)),
                                              _mm256_set1_epi32(0x7fffffff));
        const __m128i four = _mm_max_epi32(_mm256_castsi256_si128(size), _mm256_extracti128_si256(size, 1));
        const __m128i two = _mm_max_epi32(four, _mm_shuffle_epi32(four, 0x4e));
        return _mm_cvtsi128_si32(_mm_max_epi32(two, _mm_shuffle_epi32(two, 0xb1)));
    }

    /// Whether both boxes touch the same cells: cellsOfFaces() of both at once.
    bool touchSameCells(const CellBounds& cellBounds) const
    {
        const __m256i lanes = kSweepAxis == 0   ? _mm256_setr_epi32(1, 6, 2, 7, 1, 6, 2, 7)
                              : kSweepAxis == 1 ? _mm256_setr_epi32(2, 7, 0, 3, 2, 7, 0, 3)
                                                : _mm256_setr_epi32(0, 3, 1, 6, 0, 3, 1, 6);
        const __m256 tiles = _mm256_blend_ps(_mm256_permutevar8x32_ps(m_now, lanes),
                                             _mm256_permutevar8x32_ps(m_then, lanes), 0xf0);
        const __m256i cells = cellsOfTwo(tiles, cellBounds);
        const __m128i isSame =
            _mm_cmpeq_epi32(_mm256_castsi256_si128(cells), _mm256_extracti128_si256(cells, 1));
        return _mm_movemask_epi8(isSame) == 0xffff;
    }

private:
    static __m256 facesOf(const Aabb& box)
    {
        return _mm256_set_m128(_mm_loadu_ps(box.min + 2), _mm_loadu_ps(box.min));
    }
    __m256 m_now;
    __m256 m_then;
};
#else
inline Int4 bitsWithoutSign(Float4 value)
{
    Int4 bits;
    std::memcpy(&bits, &value, sizeof bits);
    return bits & 0x7fffffff;
}

inline Int4 larger(Int4 a, Int4 b)
{
    return a > b ? a : b;
}

/// The current and the previous box.
template <int kSweepAxis>
class MovedBox
{
public:
    MovedBox(const Aabb& now, const Aabb& then) : m_now(now), m_then(then) {}

    /// Largest motion of a face, as bits: floats without sign are ordered like their bits. Infinity and NaN, the
    /// motion of boxes that were or are empty, are the largest.
    std::int32_t motionBits() const
    {
        const Int4 both =
            larger(bitsWithoutSign(m_now.tile - m_then.tile), bitsWithoutSign(m_now.sweep - m_then.sweep));
        const Int4 halves = larger(both, CULLET_SHUFFLE(both, both, 2, 3, 0, 1));
        return std::max(halves[0], halves[1]);
    }

    bool touchSameCells(const CellBounds& cellBounds) const
    {
        return isTrueInAll(cellsOfFaces(m_now.tile, cellBounds) == cellsOfFaces(m_then.tile, cellBounds));
    }

private:
    BoxFaces<kSweepAxis> m_now;
    BoxFaces<kSweepAxis> m_then;
};
#endif

template <int kSweepAxis>
void compareAlong(const MotionSource& source, const std::uint32_t* rows, std::uint32_t count,
                  MotionSums& sums)
{
    const CellBounds cellBounds = {source.cellSkin, source.inverseWidth};
    std::int32_t limit;
    std::memcpy(&limit, &source.limit, sizeof limit);
    std::int32_t largest;
    std::memcpy(&largest, &sums.largest, sizeof largest);
    std::uint32_t migratedCount = 0;
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const std::uint32_t row = rows[i];
        const MovedBox<kSweepAxis> box(source.boxes[row], source.before[row]);
        const std::int32_t bits = box.motionBits();
        ++sums.octaves[static_cast<std::uint32_t>(bits) >> 23];
        if (source.motions != nullptr)
            std::memcpy(source.motions + row, &bits, sizeof bits);
        const bool isFar = bits > limit;
        largest = std::max(largest, isFar ? 0 : bits);
        sums.migrated[migratedCount] = row;
        migratedCount +=
            static_cast<unsigned>(isFar) | static_cast<unsigned>(!box.touchSameCells(cellBounds));
    }
    std::memcpy(&sums.largest, &largest, sizeof largest);
    sums.migratedCount = migratedCount;
}

void compareBoxes(const MotionSource& source, const std::uint32_t* rows, std::uint32_t count,
                  MotionSums& sums)
{
    if (source.sweepAxis == 0)
        compareAlong<0>(source, rows, count, sums);
    else if (source.sweepAxis == 1)
        compareAlong<1>(source, rows, count, sums);
    else
        compareAlong<2>(source, rows, count, sums);
}
}  // namespace
}  // namespace cullet
