// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/key_table.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/pairs/pair_tests.h"
#include "cullet/comparison/comparison_stats.h"
#include "cullet/comparison/sap_endpoints.h"

#include <array>
#include <cstdint>
#include <vector>

namespace cullet
{
/// Incremental sweep and prune of Lesson 04 (docs/references.md), "Sweep & Prune": endpoints sorted on three axes,
/// updated by insertion sort.
///
/// A box that still overlaps its last box is moved endpoint by endpoint; where an overlap begins on one axis, the two
/// boxes are compared on all three. Boxes that are created or teleport are inserted in one batch: their endpoints are
/// merged, and one sweep over the axis with the fewest tests finds their pairs, with the set of open intervals.
/// Infinite boxes need no special case, empty boxes have no endpoints. One thread.
///
/// Cost: O(endpoints passed) for coherent motion. That grows with the number of boxes at the same height, so that a
/// pile that comes to rest along an axis is the bad case (ComparisonStats::swaps shows it). A batch is
/// O(boxes + new boxes * open intervals).
class SapBackend final : public Backend, public ComparisonSource
{
public:
    Status update(const ProxyView& proxies, PairDelta& delta) override;
    void restart(const Pairs& known) override;
    const char* name() const noexcept override { return "sap"; }
    BackendStats stats() const override;
    ComparisonStats comparisonStats() const override { return m_comparisonStats; }

private:
    /// Boxes whose interval contains the position that a sweep has reached, with copies of the boxes in one array.
    struct OpenIntervals
    {
        std::vector<std::uint32_t> rows;
        std::vector<Aabb> boxes;

        void add(std::uint32_t row, const Aabb& box, std::vector<std::uint32_t>& places);
        void remove(std::uint32_t row, std::vector<std::uint32_t>& places);
        void clear();
    };

    void begin(const ProxyView& proxies);
    void classifyRow(const ProxyView& proxies, std::uint32_t row);
    void applyChanges(const ProxyView& proxies);
    void removeLeaving();
    void moveBox(std::uint32_t row, const Aabb& box);
    void insertEntering(const ProxyView& proxies);
    std::uint64_t countTestsAlong(const EndpointList& axis) const;
    void sweep(const EndpointList& axis);
    void testOpen(std::uint32_t row, const OpenIntervals& open);
    void addOverlap(std::uint64_t key);
    void applyPairRules(const ProxyView& proxies, PairDelta& delta);

    std::array<EndpointList, 3> m_axes = {EndpointList(0), EndpointList(1), EndpointList(2)};
    std::vector<Aabb> m_boxes;  ///< by row, as in the endpoint lists; empty if in none
    KeySet m_overlapping;       ///< pairs of rows that overlap now
    KeySet m_held;              ///< pairs of rows that have been reported
    /// Pairs in just one of the two sets: held by the margin alone, or excluded by the filter.
    std::vector<std::uint64_t> m_toReevaluate;
    std::vector<std::uint64_t> m_touched;  ///< pairs that entered or left m_overlapping in this update

    // Changed rows of this update, by what happens to their endpoints.
    std::vector<std::uint32_t> m_moving, m_leaving, m_entering;
    std::vector<std::uint8_t> m_isLeaving, m_isEntering;  ///< by row
    OpenIntervals m_openNew, m_openOld;
    std::vector<std::uint32_t> m_openPlaces;  ///< by row

    bool m_needsRebuild = true;
    float m_margin = 0.0f;  ///< of the last update
    Pairs m_known;          ///< given to restart(), until the next update
    Pairs m_expired;
    BackendStats m_stats;
    ComparisonStats m_comparisonStats;
};
}  // namespace cullet
