// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/columns/column_builder.h"

#include "cullet/broad/boxes/aabb_simd.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cullet
{
namespace
{
constexpr std::size_t kArrays = 7;  // floats of a ColumnSoa
}

void ColumnPool::resize(std::size_t entries)
{
    const std::size_t needed = entries + kColumnPadding;
    if (m_floats.size() < kArrays * needed)
        m_floats.resize(kArrays * (needed + needed / 4));
    m_stride = needed;
}

ColumnSoa ColumnPool::column(std::size_t offset, TaggedRow* proxyRows, std::uint32_t count, bool isBounded)
{
    float* base = m_floats.data() + offset;
    return {base,
            base + m_stride,
            base + 2 * m_stride,
            base + 3 * m_stride,
            base + 4 * m_stride,
            base + 5 * m_stride,
            proxyRows,
            count,
            isBounded ? base + 6 * m_stride : nullptr};
}

void ColumnBuilder::build(const ColumnKernels& kernels, const ColumnSource& source, ColumnSoa& column)
{
    // The kernel reads whole vectors behind the last key. The size that is compared grows last: either may throw.
    if (m_entries.size() < 2u * source.count + 4u)
    {
        m_keys.resize(3 * source.count + 4);
        m_entries.resize(3 * source.count + 4);
    }
    kernels.buildColumn(source, {m_entries.data(), m_keys.data()}, column);
}

float longestSweepExtent(const ColumnSoa& column)
{
    // Four maxima at a time: one would wait for the one before it.
    Float4 most = {};
    std::uint32_t i = 0;
    for (; i + 4 <= column.count; i += 4)
    {
        const Float4 extents = loadFloat4(column.x1 + i) - loadFloat4(column.x0 + i);
        most = extents > most ? extents : most;
    }
    float longest = std::max({most[0], most[1], most[2], most[3]});
    for (; i < column.count; ++i)
        longest = std::max(longest, column.x1[i] - column.x0[i]);
    return std::nextafter(longest, std::numeric_limits<float>::infinity());
}
}  // namespace cullet
