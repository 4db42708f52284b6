// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/aabb.h"
#include "broad/grid_plan.h"
#include "broad/row_soa.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Memory for rows as structure of arrays; grows, never shrinks.
class RowPool
{
public:
    /// Room for `entries` in all, sentinels included. Contents are lost.
    void resize(std::size_t entries);

    /// The arrays from `offset` on, `count` entries long.
    RowSoa row(std::size_t offset, std::uint32_t count);

    std::uint64_t bytes() const;

private:
    std::size_t m_stride = 0;
    std::vector<float> m_floats;
    std::vector<std::uint32_t> m_ids;
    std::vector<std::uint8_t> m_flags;
};

/// An id with its RowFlag bits in the two highest bits: proxy tables hold fewer than 2^30 rows.
using FlaggedId = std::uint32_t;
inline constexpr std::uint32_t kIdBits = 30;
inline constexpr std::uint32_t kIdMask = (1u << kIdBits) - 1;

/// Gathers the boxes of one row, sorts them by their lower bound on the sweep axis and lays them out for the kernels.
///
/// The sort is exact, because the kernels end a scan at the first x0 beyond an interval: a truncated key would lose
/// pairs. Most of the work is done by 16-bit places, evenly spaced over the row; an insertion sort on the floats does
/// the rest, and where places tell too little apart, a comparison sort takes over.
class RowBuilder
{
public:
    /// @param ids   [count] flagged ids; their boxes are valid
    /// @param grow  added on every side
    /// @param row   [out] room for count + 1 entries
    /// @return the longest extent along the sweep axis, rounded up
    float build(const FlaggedId* ids, std::uint32_t count, const Aabb* boxes, const GridPlan& plan,
                float grow, RowSoa& row);

private:
    const std::uint32_t* sortByKey(std::uint32_t count);
    const std::uint32_t* sortByPlace(std::uint32_t count, float lowest, float highest);

    std::vector<float> m_starts;         // [count] lower bounds on the sweep axis, input order
    std::vector<std::uint32_t> m_order;  // [count] input positions, sorted; and scratch of the same size
    std::vector<std::uint32_t> m_swap;
    std::vector<std::uint64_t> m_keys;
};
}  // namespace cullet
