// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/pair.h"
#include "cullet/broad/queries/query_kernels.h"
#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/pair_sync/partner_lists.h"

#include <cstdint>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The pairs that a filter callback allows, where it refuses most pairs of a crowd: takes the place of a backend.
///
/// A backend knows of all pairs of boxes that overlap. In a crowd, where a body overlaps a large share of all others,
/// these are nearly n^2, which costs memory and time even if the callback refuses all. This class does what
/// btDbvtBroadphase does: each row has a larger box, its box when it was last due, grown by the margin. A row that
/// leaves it is due, and the owner asks the filter about the rows whose larger boxes overlap its own. Only pairs that
/// it allows are listed, and only these are tested when a box changes; they enter and leave by the rules of Backend.
///
/// So the filter was asked about every pair of boxes that overlap, and of a refused pair nothing is stored. Among so
/// many partners a scan of all larger boxes is as fast as any search.
///
/// Cost of an update: O(changed rows + listed pairs of these), and O(rows) for each row that is due. Memory: 29 bytes a
/// row, 24 more once a pair is listed, 5 a listed pair of up to 2^15 rows and 10 of more.
class AllowedPairs
{
public:
    /// Whether these are a crowd that refuses most pairs, which this class is faster for than a backend.
    static bool isCrowd(std::uint64_t refused, std::uint64_t allowed, std::uint64_t rows) noexcept
    {
        return kCrowdShare * refused >= rows * rows && kRefusedPerAllowed * allowed <= refused;
    }

    /// @param baselineSimd as in GridOptions
    /// @param view         all boxes; its changes are not read
    explicit AllowedPairs(const ProxyView& view, bool baselineSimd);

    /// Adds a pair that a former backend held.
    void addHeld(std::uint32_t rowFirst, std::uint32_t rowSecond)
    {
        m_lists.insert(rowFirst, rowSecond, true);
    }

    /// As Backend::update() for the listed pairs. May throw std::bad_alloc; this object is then to be discarded.
    ///
    /// @param due [out] appended: the unique ids of the rows that are due
    void update(const ProxyView& view, PairDelta& delta, std::vector<std::uint32_t>& due);

    /// The rows whose larger boxes overlap that of the row, ascending, without those of listed pairs and those that are
    /// due: they ask for the pair in their turn. The row is then no longer due.
    void takePartners(std::uint32_t row, std::vector<std::uint32_t>& partners);
    /// Stores how many of these the filter refused.
    void setRefused(std::uint32_t row, std::uint32_t count) noexcept;

    /// Lists a pair that the filter allows.
    ///
    /// @param isHeld whether the boxes overlap, so that the owner adds the pair
    void insert(std::uint32_t rowA, std::uint32_t rowB, bool isHeld) { m_lists.insert(rowA, rowB, isHeld); }
    void erase(std::uint32_t rowA, std::uint32_t rowB) noexcept { m_lists.erase(rowA, rowB); }

    /// Whether this still is a crowd, or nearly one.
    bool isStillCrowd() const noexcept { return isCrowd(2 * m_refusedSum, m_lists.size(), m_rows); }

    std::size_t size() const noexcept { return m_lists.size(); }
    std::uint64_t bytes() const noexcept;
    /// Box tests of the last update: those of listed pairs, and of the scans since.
    std::uint64_t tests() const noexcept { return m_tests; }

private:
    /// In a crowd one of half so many pairs of rows is refused, and at least so many for each that is allowed.
    static constexpr std::uint64_t kCrowdShare = 128, kRefusedPerAllowed = 1;

    void growTo(std::uint32_t rows);
    void testChanged(const ProxyView& view, PairDelta& delta);
    bool test(std::uint32_t row, std::uint32_t other, bool isHeld, const ProxyView& view, PairDelta& delta);
    void forget(std::uint32_t row) noexcept;
    void dropApart(std::uint32_t row);

    const QueryKernels& m_kernels;
    PartnerLists m_lists;                  // flag: reported as added; else only the larger boxes overlap
    std::vector<std::uint8_t> m_isDue;     // by row
    std::vector<std::uint32_t> m_refused;  // by row: refused partners when it was last due
    std::vector<Aabb> m_largerBoxes;       // by row; empty where the box is invalid
    std::uint64_t m_refusedSum = 0;
    std::uint64_t m_rows = 0;  // of the last view
    std::uint64_t m_tests = 0;
    bool m_isNew = true;  // no update yet
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
