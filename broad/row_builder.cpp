// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/row_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

namespace cullet
{
namespace
{
/// Integer in the order of the floats, -0 and +0 told apart (they compare equal, so any order of the two will do).
std::uint32_t orderedBits(float value)
{
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    const std::uint32_t negative = static_cast<std::uint32_t>(-static_cast<std::int32_t>(bits >> 31));
    return bits ^ (negative | 0x80000000u);
}

constexpr std::uint32_t kFewEntries = 48;
constexpr std::uint32_t kMostPlaces = 65536;

/// One pass of a radix sort on eight bits of the elements; `offsets` are the exclusive sums of the digit's histogram.
void scatterByDigit(const std::uint32_t* from, std::uint32_t* to, std::uint32_t count, std::uint32_t shift,
                    std::array<std::uint32_t, 256>& offsets)
{
    for (std::uint32_t i = 0; i < count; ++i)
        to[offsets[from[i] >> shift & 0xff]++] = from[i];
}

void makeExclusive(std::array<std::uint32_t, 256>& histogram)
{
    std::uint32_t sum = 0;
    for (std::uint32_t& slot : histogram)
    {
        const std::uint32_t size = slot;
        slot = sum;
        sum += size;
    }
}
}  // namespace

void RowPool::resize(std::size_t entries)
{
    const std::size_t needed = entries + kRowPadding;
    m_stride = needed;
    if (m_floats.size() < 6 * needed)
        m_floats.resize(6 * (needed + needed / 4));
}

RowSoa RowPool::row(std::size_t offset, FlaggedId* ids, std::uint32_t count)
{
    float* base = m_floats.data() + offset;
    return {base,
            base + m_stride,
            base + 2 * m_stride,
            base + 3 * m_stride,
            base + 4 * m_stride,
            base + 5 * m_stride,
            ids,
            count};
}

/// Order of m_starts by comparisons, for rows too short or too uneven for places.
const std::uint32_t* RowBuilder::sortByKey(std::uint32_t count)
{
    for (std::uint32_t i = 0; i < count; ++i)
        m_keys[i] = static_cast<std::uint64_t>(orderedBits(m_starts[i])) << 32 | i;
    std::sort(m_keys.begin(), m_keys.begin() + count);
    for (std::uint32_t i = 0; i < count; ++i)
        m_order[i] = static_cast<std::uint32_t>(m_keys[i]);
    return m_order.data();
}

const std::uint32_t* RowBuilder::sortByPlace(std::uint32_t count, float lowest, float highest)
{
    // Rounding is monotone at every step, so places never contradict the floats; they only tell fewer apart.
    const float scale = 65535.0f / (highest - lowest);
    if (!(scale > 0 && scale < std::numeric_limits<float>::infinity()))
        return sortByKey(count);
    std::array<std::uint32_t, 256> low{};
    std::array<std::uint32_t, 256> high{};
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const auto place =
            std::min(static_cast<std::uint32_t>((m_starts[i] - lowest) * scale), kMostPlaces - 1);
        m_order[i] = place << 16 | i;
        ++low[place & 0xff];
        ++high[place >> 8];
    }
    makeExclusive(low);
    makeExclusive(high);
    scatterByDigit(m_order.data(), m_swap.data(), count, 16, low);
    scatterByDigit(m_swap.data(), m_order.data(), count, 24, high);
    std::uint32_t moves = 0;
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const std::uint32_t position = m_order[i] & 0xffff;
        std::uint32_t j = i;
        for (; j > 0 && m_starts[m_order[j - 1]] > m_starts[position]; --j, ++moves)
            m_order[j] = m_order[j - 1];
        m_order[j] = position;
        if (moves > 8 * count)
            return sortByKey(count);
    }
    return m_order.data();
}

void RowBuilder::makeRoom(std::uint32_t count)
{
    if (m_starts.size() >= count)
        return;
    m_starts.resize(count + count / 2);
    m_order.resize(m_starts.size());
    m_swap.resize(m_starts.size());
    m_keys.resize(m_starts.size());
}

void RowBuilder::sort(FlaggedId* ids, std::uint32_t count, const Aabb* boxes, int sweepAxis)
{
    makeRoom(count);
    float lowest = std::numeric_limits<float>::infinity();
    float highest = -std::numeric_limits<float>::infinity();
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const float start = boxes[ids[i] & kIdMask].min[sweepAxis];
        m_starts[i] = start;
        lowest = start < lowest ? start : lowest;
        highest = start > highest ? start : highest;
    }
    const bool byKey = count <= kFewEntries || count > kMostPlaces;
    const std::uint32_t* order = byKey ? sortByKey(count) : sortByPlace(count, lowest, highest);
    for (std::uint32_t i = 0; i < count; ++i)
        m_swap[i] = ids[order[i]];
    std::copy_n(m_swap.begin(), count, ids);
}

void RowBuilder::build(const RowKernels& kernels, const RowSource& source, RowSoa& row)
{
    // Whole vectors are read behind the last one.
    if (m_records.size() < 2u * source.count + 4u)
        m_records.resize(3 * source.count + 4);
    const std::uint32_t count = kernels.gatherRow(source, m_records.data());
    kernels.layOut(m_records.data(), count, row);
}

std::uint64_t RowBuilder::bytes() const
{
    return m_starts.capacity() * (sizeof(float) + 2 * sizeof(std::uint32_t) + sizeof(std::uint64_t)) +
           m_records.capacity() * sizeof(RowRecord);
}

float longestOf(const RowSoa& row)
{
    float longest = 0;
    for (std::uint32_t i = 0; i < row.count; ++i)
        longest = std::max(longest, row.x1[i] - row.x0[i]);
    return std::nextafter(longest, std::numeric_limits<float>::infinity());
}
}  // namespace cullet
