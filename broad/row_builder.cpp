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

void insertionSort(std::uint64_t* keys, std::uint32_t count)
{
    for (std::uint32_t i = 1; i < count; ++i)
    {
        const std::uint64_t key = keys[i];
        std::uint32_t j = i;
        for (; j > 0 && keys[j - 1] > key; --j)
            keys[j] = keys[j - 1];
        keys[j] = key;
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

void RowBuilder::sortKeys(std::uint32_t count)
{
    if (count <= 24)
        return insertionSort(m_keys.data(), count);
    if (count <= 128)
    {
        std::sort(m_keys.begin(), m_keys.begin() + count);
        return;
    }
    // Least significant digit first, 8 bits at a time; digits that all keys share are skipped.
    std::array<std::array<std::uint32_t, 256>, 4> histogram{};
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const std::uint64_t key = m_keys[i];
        for (std::uint32_t digit = 0; digit < 4; ++digit)
            ++histogram[digit][(key >> (32 + 8 * digit)) & 0xff];
    }
    for (std::uint32_t digit = 0; digit < 4; ++digit)
    {
        const std::uint32_t shift = 32 + 8 * digit;
        if (histogram[digit][(m_keys[0] >> shift) & 0xff] == count)
            continue;
        std::uint32_t sum = 0;
        for (std::uint32_t& slot : histogram[digit])
        {
            const std::uint32_t size = slot;
            slot = sum;
            sum += size;
        }
        for (std::uint32_t i = 0; i < count; ++i)
            m_swap[histogram[digit][(m_keys[i] >> shift) & 0xff]++] = m_keys[i];
        m_keys.swap(m_swap);
    }
}

float RowBuilder::build(const FlaggedId* ids, std::uint32_t count, const Aabb* boxes, const GridPlan& plan,
                        float grow, RowSoa& row)
{
    if (m_keys.size() < count)
    {
        m_keys.resize(count + count / 2);
        m_swap.resize(m_keys.size());
        m_boxes.resize(m_keys.size());
    }
    const int x = plan.sweepAxis;
    const int y = plan.tileAxisY;
    const int z = plan.tileAxisZ;
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const Aabb& box = boxes[ids[i] & kIdMask];
        m_boxes[i] = {{box.min[x] - grow, box.min[y] - grow, box.min[z] - grow},
                      {box.max[x] + grow, box.max[y] + grow, box.max[z] + grow}};
        m_keys[i] = static_cast<std::uint64_t>(orderedBits(m_boxes[i].min[0])) << 32 | i;
    }
    sortKeys(count);
    float longest = 0;
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const std::uint32_t from = static_cast<std::uint32_t>(m_keys[i]);
        const Aabb& box = m_boxes[from];
        row.x0[i] = box.min[0];
        row.x1[i] = box.max[0];
        row.y0[i] = box.min[1];
        row.y1[i] = box.max[1];
        row.z0[i] = box.min[2];
        row.z1[i] = box.max[2];
        row.id[i] = ids[from] & kIdMask;
        row.flags[i] = static_cast<std::uint8_t>(ids[from] >> kIdBits);
        longest = std::max(longest, box.max[0] - box.min[0]);
    }
    row.x0[count] = std::numeric_limits<float>::infinity();
    row.count = count;
    return std::nextafter(longest, std::numeric_limits<float>::infinity());
}
}  // namespace cullet
