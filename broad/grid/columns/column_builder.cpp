// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/columns/column_builder.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cullet
{
namespace
{
constexpr std::size_t kArrays = 7;  // floats of a ColumnSoa
}

void RowPool::resize(std::size_t entries)
{
    const std::size_t needed = entries + kRowPadding;
    m_stride = needed;
    if (m_floats.size() < kArrays * needed)
        m_floats.resize(kArrays * (needed + needed / 4));
}

ColumnSoa RowPool::row(std::size_t offset, FlaggedId* ids, std::uint32_t count, bool isBounded)
{
    float* base = m_floats.data() + offset;
    return {base,
            base + m_stride,
            base + 2 * m_stride,
            base + 3 * m_stride,
            base + 4 * m_stride,
            base + 5 * m_stride,
            ids,
            count,
            isBounded ? base + 6 * m_stride : nullptr};
}

void ColumnBuilder::build(const ColumnKernels& kernels, const RowSource& source, ColumnSoa& row)
{
    // The kernel reads whole vectors behind the last key.
    if (m_records.size() < 2u * source.count + 4u)
    {
        m_records.resize(3 * source.count + 4);
        m_keys.resize(3 * source.count + 4);
    }
    kernels.buildRow(source, {m_records.data(), m_keys.data()}, row);
}

float longestOf(const ColumnSoa& row)
{
    float longest = 0;
    for (std::uint32_t i = 0; i < row.count; ++i)
        longest = std::max(longest, row.x1[i] - row.x0[i]);
    return std::nextafter(longest, std::numeric_limits<float>::infinity());
}
}  // namespace cullet
