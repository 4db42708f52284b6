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
/// The rows of a QueryIndex outside its main tree: a second tree and a list. Boxes of listed rows may have become
/// empty.
struct SecondaryRows
{
    explicit SecondaryRows(const QueryKernels& kernels) : tree(kernels) {}

    Bvh tree;
    std::vector<ProxyId> listed;
    std::uint32_t unboundedCount = 0;  ///< listed rows that no tree can store
    bool isUpToDate = true;            ///< no other row is listed, and the tree has the current boxes
};

/// The trees of a QueryIndex and their updates; each row with a valid box is in exactly one of three places.
///
/// Most rows are in the main tree. Rows that were created or teleported since it was built are outside of it: a few on
/// a list, to be tested one by one, the others in a second tree. Rows that extend beyond kMaxTreeCoordinate are on
/// the list too. So a change costs no more than the path to the root of a tree, and the list is moved into the second
/// tree when scans of the list have cost as much.
///
/// Not synchronised: the caller ensures that no thread reads during sync(), and that one thread at a time calls sync()
/// or rebuildSecondTree().
class QueryTrees
{
public:
    explicit QueryTrees(const QueryKernels& kernels)
        : m_main(kernels), m_secondary{SecondaryRows(kernels), SecondaryRows(kernels)}
    {
    }

    /// Applies the changes of the table since the last call.
    ///
    /// Cost: sixty scanned boxes per changed row, or about ten per row of the table if that is less; a rebuild,
    /// O(n log n), after enough rows were created, destroyed or moved far since the last one. If it throws
    /// (std::bad_alloc), the next call rebuilds everything.
    void sync(ProxyTable& table);

    /// Puts the listed rows into a new second tree. O(m log m) for m rows outside the main tree.
    ///
    /// Other threads may read the trees meanwhile, provided that the table has not changed since the last sync():
    /// second tree and list are double-buffered, and the copy that is being read does not change. One call at most
    /// between two calls of sync(). If it throws (std::bad_alloc), readers are not affected, and the next sync()
    /// rebuilds everything.
    void rebuildSecondTree(const ProxyTable& table);

    /// Estimated cost of the next sync(), in scanned boxes, if as many rows change as before the last one.
    double expectedSyncCost(const ProxyTable& table) const noexcept;

    /// Cost of the first sync() per live row, in scanned boxes.
    static constexpr double kFirstSyncCost = 70.0;

    /// Cost of rebuildSecondTree() in tests of listed rows, which are slower than those of a scan because they wait
    /// for memory.
    ///
    /// Underestimated, so that a frame of many queries after many changes loses little before that call.
    static double secondTreeCost(const SecondaryRows& secondary) noexcept;

    const Bvh& mainTree() const noexcept { return m_main; }
    /// The copy to read; a query uses the same copy from its begin to its end.
    const SecondaryRows& secondary() const noexcept
    {
        return m_secondary[m_current.load(std::memory_order_acquire)];
    }
    std::uint64_t buildsTotal() const noexcept { return m_buildsTotal; }
    std::uint64_t syncsTotal() const noexcept { return m_syncsTotal; }
    /// Rows that were put into new trees.
    std::uint64_t builtRowsTotal() const noexcept { return m_builtRowsTotal; }
    std::uint64_t bytes() const noexcept;

private:
    // Values of m_places; smaller values are slots of the main tree.
    static constexpr std::uint32_t kInSecondTree = 0xE0000000u;  // and above: slots of the second tree
    static constexpr std::uint32_t kListed = 0xFFFFFFFEu;
    static constexpr std::uint32_t kNowhere = 0xFFFFFFFFu;

    SecondaryRows& currentSecondary() noexcept
    {
        return m_secondary[m_current.load(std::memory_order_relaxed)];
    }
    static void appendRows(const Bvh& tree, std::vector<ProxyId>& rows);
    static void appendRows(const SecondaryRows& secondary, std::vector<ProxyId>& rows);
    std::vector<ProxyId> findRows(const ProxyTable& table);
    std::vector<ProxyId> placedRows() const;
    void rebuild(const ProxyTable& table, std::vector<ProxyId> rows);
    void fill(const ProxyTable& table, std::vector<ProxyId>& rows, Bvh& tree, SecondaryRows& secondary);
    void recordPlaces(const Bvh& tree, std::uint32_t firstPlace) noexcept;
    void applyChanges(const ProxyTable& table);
    void refit(const ProxyTable& table);
    void moveOneByOne(const ProxyTable& table);
    void moveInTree(Bvh& tree, std::uint32_t slot, ProxyId row, const Aabb& box);
    void list(ProxyId row, const Aabb& box);
    bool needsRebuild() const noexcept;

    Bvh m_main;
    SecondaryRows m_secondary[2];
    std::atomic<std::uint32_t> m_current{0};
    std::vector<std::uint32_t> m_places;  // by row: slot, kListed or kNowhere
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
