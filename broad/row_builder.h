// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/aabb.h"
#include "broad/row_soa.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Memory for the boxes of rows as structure of arrays; grows, never shrinks.
class RowPool
{
public:
    /// Room for `entries` in all, sentinels included. Contents are lost.
    void resize(std::size_t entries);

    /// The arrays from `offset` on, with ids elsewhere.
    RowSoa row(std::size_t offset, FlaggedId* ids, std::uint32_t count);

    std::uint64_t bytes() const { return m_floats.capacity() * sizeof(float); }

private:
    std::size_t m_stride = 0;
    std::vector<float> m_floats;
};

/// Brings the ids of a row into the order of their lower bounds on the sweep axis and lays their boxes out.
///
/// The order is exact, because the kernels end a scan at the first x0 beyond an interval: a truncated key would lose
/// pairs. Ids in no order are sorted by 16-bit places first, evenly spaced over the row; where places tell too little
/// apart, by comparisons. Ids that were sorted in the last update are nearly so now, and an insertion sort, part of
/// gatherRow(), is enough.
class RowBuilder
{
public:
    /// Sorts ids in any order.
    void sort(FlaggedId* ids, std::uint32_t count, const Aabb* boxes, int sweepAxis);

    /// Lays out the boxes of nearly sorted ids, and writes the ids back in order.
    ///
    /// @param row [in, out] room for count + 5 boxes and for a multiple of four ids; on return those inside the cell
    void build(const RowKernels& kernels, const RowSource& source, RowSoa& row);

    std::uint64_t bytes() const;

private:
    void makeRoom(std::uint32_t count);
    const std::uint32_t* sortByKey(std::uint32_t count);
    const std::uint32_t* sortByPlace(std::uint32_t count, float lowest, float highest);

    std::vector<float> m_starts;         // [count] lower bounds on the sweep axis, input order
    std::vector<std::uint32_t> m_order;  // [count] input positions, sorted; and scratch of the same size
    std::vector<std::uint32_t> m_swap;
    std::vector<std::uint64_t> m_keys;
    std::vector<RowRecord> m_records;
};

/// Longest extent along the sweep axis, rounded up.
float longestOf(const RowSoa& row);
}  // namespace cullet
