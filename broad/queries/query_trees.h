// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/array.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/broad/queries/bvh.h"

#include <atomic>
#include <cstdint>
#include <vector>

namespace cullet
{
/// The rows beside the main tree of a QueryIndex. Those on the list may have become empty since.
struct QuerySide
{
    explicit QuerySide(const QueryKernels& kernels) : tree(kernels) {}

    Bvh tree;
    std::vector<ProxyId> listed;
    std::uint32_t settledCount = 0;  ///< of the listed rows, those that no tree can take
    bool isTidy = true;              ///< no other row is listed
};

/// The trees behind a QueryIndex and their upkeep; each row with a valid box is in exactly one of three places.
///
/// Most rows are in the main tree. Rows that came or jumped since it was built are beside it: a few on a list, to be
/// tested one by one, the others in a second tree. Rows that reach beyond kTreeReach are on the list too. So a change
/// costs no more than a way up a tree, and the list is cleared into the second tree when its scans have cost as much.
///
/// Not synchronised: whoever calls sync() sees to it that nobody reads meanwhile, and that one thread at a time calls
/// sync() or tidy().
class QueryTrees
{
public:
    explicit QueryTrees(const QueryKernels& kernels)
        : m_main(kernels), m_sides{QuerySide(kernels), QuerySide(kernels)}
    {
    }

    /// Takes in the changes of the table since the last call.
    ///
    /// Cost: sixty scanned boxes per changed row, or about ten per row of the table if that is less; a building (O(n log n))
    /// when enough rows came, went or wandered since the last. If it throws (std::bad_alloc), the next call builds everything anew.
    void sync(ProxyTable& table);

    /// Puts the listed rows into a new second tree. O(m log m) for m rows beside the main tree.
    ///
    /// Others may read the trees meanwhile, provided that the table is as it was at the last sync(): there are two
    /// sides, and the one that they read stays as it is. It is tidied once at most between two calls of sync().
    /// If it throws (std::bad_alloc), readers notice nothing, and the next sync() builds everything anew.
    void tidy(const ProxyTable& table);

    /// Estimate of what the next sync() costs if as much changed as before the last one, in scanned boxes.
    double expectedSyncCost(const ProxyTable& table) const noexcept;

    /// What the first costs for each live row.
    static constexpr double kFirstSyncCost = 70.0;

    /// What tidy() costs, in tests of listed rows: these are dearer than those of a scan, because they wait for memory.
    ///
    /// Taken for less than it is, so that a frame of many queries after many changes loses little before it is bought.
    static double tidyCost(const QuerySide& side) noexcept;

    const Bvh& mainTree() const noexcept { return m_main; }
    /// The side to read; a query stays with the one that it began with.
    const QuerySide& side() const noexcept { return m_sides[m_current.load(std::memory_order_acquire)]; }
    std::uint64_t buildsTotal() const noexcept { return m_buildsTotal; }
    std::uint64_t syncsTotal() const noexcept { return m_syncsTotal; }
    /// Rows that went into new trees.
    std::uint64_t builtRowsTotal() const noexcept { return m_builtRowsTotal; }
    std::uint64_t bytes() const noexcept;

private:
    // Values of m_places; below them are slots of the main tree.
    static constexpr std::uint32_t kInSideTree = 0xE0000000u;  // and above: slots of the side's tree
    static constexpr std::uint32_t kListed = 0xFFFFFFFEu;
    static constexpr std::uint32_t kNowhere = 0xFFFFFFFFu;

    QuerySide& ownSide() noexcept { return m_sides[m_current.load(std::memory_order_relaxed)]; }
    static void appendRows(const Bvh& tree, std::vector<ProxyId>& rows);
    static void appendRows(const QuerySide& side, std::vector<ProxyId>& rows);
    std::vector<ProxyId> findRows(const ProxyTable& table);
    std::vector<ProxyId> placedRows() const;
    void rebuild(const ProxyTable& table, std::vector<ProxyId> rows);
    void fill(const ProxyTable& table, std::vector<ProxyId>& rows, Bvh& tree, QuerySide& side);
    void notePlaces(const Bvh& tree, std::uint32_t firstPlace) noexcept;
    void followChanges(const ProxyTable& table);
    void refit(const ProxyTable& table);
    void moveEach(const ProxyTable& table);
    void moveIn(Bvh& tree, std::uint32_t slot, ProxyId row, const Aabb& box);
    void list(ProxyId row, const Aabb& box);
    bool needsRebuild() const noexcept;

    Bvh m_main;
    QuerySide m_sides[2];
    std::atomic<std::uint32_t> m_current{0};
    std::vector<std::uint32_t> m_places;  // by row: where it is
    Array<ProxyId> m_changed;
    std::vector<ProxyId> m_left;
    std::uint32_t m_changedCount = 0;
    bool m_isBuilt = false;
    double m_refitsSinceBuild = 0.0;
    std::uint64_t m_buildsTotal = 0;
    std::uint64_t m_syncsTotal = 0;
    std::uint64_t m_builtRowsTotal = 0;
};
}  // namespace cullet
