// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/row_builder.h"

#include <algorithm>
#include <array>
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
    if (m_ids.size() >= needed && m_floats.size() >= 6 * needed)
        return;
    m_floats.resize(6 * (needed + needed / 4));
    m_ids.resize(needed + needed / 4);
    m_flags.resize(needed + needed / 4);
}

RowSoa RowPool::row(std::size_t offset, std::uint32_t count)
{
    float* base = m_floats.data() + offset;
    return {base,
            base + m_stride,
            base + 2 * m_stride,
            base + 3 * m_stride,
            base + 4 * m_stride,
            base + 5 * m_stride,
            m_ids.data() + offset,
            m_flags.data() + offset,
            count};
}

std::uint64_t RowPool::bytes() const
{
    return m_floats.capacity() * sizeof(float) + m_ids.capacity() * sizeof(std::uint32_t) +
           m_flags.capacity();
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

float RowBuilder::build(const FlaggedId* ids, std::uint32_t count, const Aabb* boxes, const GridPlan& plan,
                        float grow, RowSoa& row)
{
    if (m_starts.size() < count)
    {
        m_starts.resize(count + count / 2);
        m_order.resize(m_starts.size());
        m_swap.resize(m_starts.size());
        m_keys.resize(m_starts.size());
    }
    const int x = plan.sweepAxis;
    const int y = plan.tileAxisY;
    const int z = plan.tileAxisZ;
    float lowest = std::numeric_limits<float>::infinity();
    float highest = -std::numeric_limits<float>::infinity();
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const float start = boxes[ids[i] & kIdMask].min[x] - grow;
        m_starts[i] = start;
        lowest = start < lowest ? start : lowest;
        highest = start > highest ? start : highest;
    }
    const bool byKey = count <= kFewEntries || count > kMostPlaces;
    const std::uint32_t* order = byKey ? sortByKey(count) : sortByPlace(count, lowest, highest);
    float longest = 0;
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const FlaggedId id = ids[order[i]];
        const Aabb& box = boxes[id & kIdMask];
        row.x0[i] = box.min[x] - grow;
        row.x1[i] = box.max[x] + grow;
        row.y0[i] = box.min[y] - grow;
        row.y1[i] = box.max[y] + grow;
        row.z0[i] = box.min[z] - grow;
        row.z1[i] = box.max[z] + grow;
        row.id[i] = id & kIdMask;
        row.flags[i] = static_cast<std::uint8_t>(id >> kIdBits);
        const float length = row.x1[i] - row.x0[i];
        longest = length > longest ? length : longest;
    }
    row.x0[count] = std::numeric_limits<float>::infinity();
    row.count = count;
    return std::nextafter(longest, std::numeric_limits<float>::infinity());
}
}  // namespace cullet
