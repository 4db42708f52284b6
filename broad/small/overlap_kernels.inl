// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Body of the overlap kernels; each including source is compiled for another instruction set. Each value is rounded
// once, so every width finds the same pairs.
#include "cullet/base/vector16.h"
#include "cullet/broad/small/overlap_kernels.h"

#if defined(__AVX__)
#include <immintrin.h>
#endif

namespace cullet
{
#include "cullet/base/simd_lanes.inl"

namespace
{
/// The box of one row in all lanes, and the arrays of boxes that it is tested against.
class OverlapQuery
{
public:
    OverlapQuery(const BoxArrays& boxes, std::uint32_t row, float growth)
        : m_limits(boxes.limits), m_stride(boxes.stride)
    {
        for (int limit = 0; limit < 6; ++limit)
            m_box[limit] = Lanes::broadcast(*at(limit, row) + (limit % 2 == 0 ? -growth : growth));
    }

    /// Returns a bit for each of the Lanes::kWidth boxes from `other` on: whether it overlaps the box.
    std::uint32_t test(std::uint32_t other) const
    {
        return Lanes::bits(
            Lanes::both(Lanes::both(testAxis(0, other), testAxis(1, other)), testAxis(2, other)));
    }

private:
    const float* at(int limit, std::uint32_t other) const
    {
        return m_limits + static_cast<std::uint32_t>(limit) * std::size_t{m_stride} + other;
    }
    Lanes::Mask testAxis(int axis, std::uint32_t other) const
    {
        return Lanes::both(Lanes::le(m_box[2 * axis], Lanes::load(at(2 * axis + 1, other))),
                           Lanes::le(Lanes::load(at(2 * axis, other)), m_box[2 * axis + 1]));
    }

    const float* m_limits;
    std::uint32_t m_stride;
    Lanes::Value m_box[6];
};

void findOverlaps(const BoxArrays& boxes, std::uint32_t row, float growth, std::uint32_t firstWord,
                  std::uint64_t* bits)
{
    const OverlapQuery query(boxes, row, growth);
    for (std::uint32_t word = firstWord; word < boxes.stride / 64; ++word)
    {
        std::uint64_t found = 0;
        const std::uint32_t rows = boxes.rows > 64 * word ? boxes.rows - 64 * word : 0;
        const std::uint32_t lanes = rows < 64 ? rows : 64;
        for (std::uint32_t lane = 0; lane < lanes; lane += Lanes::kWidth)
            found |= std::uint64_t{query.test(64 * word + lane)} << lane;
        bits[word] = found;
    }
}
}  // namespace
}  // namespace cullet
