// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/box_tree.h"
#include "broad/proxy_table.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// The trees behind a QueryIndex and their upkeep; each row with a valid box is in exactly one of three places.
///
/// Most rows are in the main tree. Rows that came or jumped since it was built are in a second tree, so small that it
/// is built anew whenever it changes. Rows that reach beyond kTreeReach are on a list.
///
/// Not synchronised: whoever calls sync() sees to it that nobody reads meanwhile.
class QueryTrees
{
public:
    explicit QueryTrees(const QueryKernels& kernels) : m_main(kernels), m_recent(kernels) {}

    /// Takes in the changes of the table since the last call.
    ///
    /// Cost: about ten scanned boxes per changed row, a building (O(n log n)) when enough rows came, went or wandered since the last.
    /// If it throws (std::bad_alloc), the next call builds everything anew.
    void sync(ProxyTable& table);

    /// Estimate of what the next sync() costs if as much changed as before the last one, in scanned boxes.
    double expectedSyncCost(std::uint32_t rowCount) const noexcept;

    const BoxTree& mainTree() const noexcept { return m_main; }
    const BoxTree& recentTree() const noexcept { return m_recent; }
    const std::vector<ProxyId>& unboundedRows() const noexcept { return m_unbounded; }
    std::uint64_t buildsTotal() const noexcept { return m_buildsTotal; }
    std::uint64_t syncsTotal() const noexcept { return m_syncsTotal; }
    std::uint64_t bytes() const noexcept;

private:
    // Values of m_places that are not slots of the main tree.
    static constexpr std::uint32_t kNowhere = 0xFFFFFFFFu;
    static constexpr std::uint32_t kRecent = 0xFFFFFFFEu;
    static constexpr std::uint32_t kUnbounded = 0xFFFFFFFDu;

    void rebuild(const ProxyTable& table);
    void followChanges(const ProxyTable& table);
    void refitMain(const ProxyTable& table);
    void moveInMain(ProxyId row, const Aabb& box);
    void put(ProxyId row, const Aabb& box);
    bool needsRebuild() const noexcept;

    BoxTree m_main;
    BoxTree m_recent;
    std::vector<ProxyId> m_recentRows;
    std::vector<ProxyId> m_unbounded;
    std::vector<std::uint32_t> m_places;  // by row: slot of the main tree, or one of the three above
    std::vector<ProxyId> m_changed;
    std::vector<ProxyId> m_left;
    std::uint32_t m_changedCount = 0;
    bool m_isBuilt = false;
    bool m_isRecentStale = false;
    bool m_isUnboundedStale = false;
    std::uint32_t m_syncsSinceBuild = 0;
    std::uint64_t m_buildsTotal = 0;
    std::uint64_t m_syncsTotal = 0;
};
}  // namespace cullet
