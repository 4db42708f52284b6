// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/grid/columns/column_soa.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Memory for the boxes of columns as structure of arrays; grows, never shrinks.
class ColumnPool
{
public:
    /// Makes room for `entries` in all, sentinels included. Contents are lost.
    void resize(std::size_t entries);

    /// The arrays from `offset` on; the TaggedRow array is memory of the caller.
    ///
    /// @param isBounded whether the column has an array of bounds
    ColumnSoa column(std::size_t offset, TaggedRow* proxyRows, std::uint32_t count, bool isBounded = false);

    std::uint64_t bytes() const { return m_floats.capacity() * sizeof(float); }

private:
    std::size_t m_stride = 0;
    std::vector<float> m_floats;
};

/// Sorts the boxes of a column by their lower bounds on the sweep axis and lays them out.
///
/// The order is exact, because the kernels end a scan at the first x0 beyond an interval: a truncated key would lose
/// pairs.
class ColumnBuilder
{
public:
    /// Lays out the boxes of a source, and writes its TaggedRow array back in order.
    ///
    /// @param column [in, out] memory for count + 5 boxes and a multiple of four TaggedRow values; receives the
    /// boxes in the cell
    void build(const ColumnKernels& kernels, const ColumnSource& source, ColumnSoa& column);

    std::uint64_t bytes() const
    {
        return m_entries.capacity() * sizeof(ColumnEntry) + m_keys.capacity() * sizeof(SortKey);
    }

private:
    std::vector<ColumnEntry> m_entries;
    std::vector<SortKey> m_keys;
};

/// Longest extent along the sweep axis, rounded up.
float longestSweepExtent(const ColumnSoa& column);
}  // namespace cullet
