// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/broad/queries/query_kernels.h"
#include "cullet/broad/row_pair.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Boxes with coordinates beyond this (Bullet's static planes extend to 1e18) are not stored in a tree: every query
/// would enter each node above them.
inline constexpr float kMaxTreeCoordinate = 1e15f;

/// Eight-wide tree of boxes over some rows of a table; complete, so that it needs no links.
///
/// wideTreeOrder() decides which rows share a node.
///
/// Memory: 32 bytes per row. One thread at a time may modify the tree; any number of threads may traverse it while no
/// thread modifies it.
class Bvh
{
public:
    explicit Bvh(const QueryKernels& kernels = queryKernels(false)) : m_kernels(kernels) {}
    Bvh(const Bvh&) = delete;
    Bvh& operator=(const Bvh&) = delete;

    /// Replaces the tree by one over `rows`. O(n log n).
    ///
    /// @param boxes by row; those of `rows` are valid and bounded
    /// @param rows  each once; any order
    void build(const Aabb* boxes, const std::vector<ProxyId>& rows);

    /// Lanes of all leaves; a slot is a lane that may hold a row.
    std::uint32_t slotCount() const noexcept { return static_cast<std::uint32_t>(m_rows.size()); }
    ProxyId rowAt(std::uint32_t slot) const noexcept { return m_rows[slot]; }

    /// True when a box may stay in a slot without enlarging its leaf too much: it is valid, bounded and lies within the
    /// leaf's box grown by about its own size.
    bool fits(std::uint32_t slot, const Aabb& box) const noexcept;

    /// True when a valid box lies within what is stored for the slot and fills half of it or more on each axis. O(1).
    bool holds(std::uint32_t slot, const Aabb& box) const noexcept;

    /// Changes the box of one slot and of every node above it that it changes. O(depth).
    void move(std::uint32_t slot, const Aabb& box) noexcept;

    /// Empties one slot. O(depth).
    void remove(std::uint32_t slot) noexcept;

    /// Reads the boxes of all rows again; rows that are invalid, unbounded or do not fit leave their slots. O(n).
    ///
    /// @param left [out] rows that left are appended
    void refit(const Aabb* boxes, std::vector<ProxyId>& left);

    /// Sum of the half areas of all leaves, and its value after build(): their ratio measures how the tree degrades.
    double leafArea() const noexcept { return m_leafArea; }
    double leafAreaAtBuild() const noexcept { return m_leafAreaAtBuild; }
    std::uint32_t rowCount() const noexcept { return m_rowCount; }

    const BoxTreeView& view() const noexcept { return m_view; }
    std::uint64_t bytes() const noexcept;

private:
    void layOut(std::uint32_t slots);
    bool fillLanes(std::uint32_t leaf, const Aabb* boxes, Aabb& around);
    void prefetch(std::uint32_t leaf, const Aabb* boxes) const noexcept;
    void closeLeaf(std::uint32_t leaf, const Aabb& around) noexcept;
    void removeUnfitRows(std::uint32_t leaf, const Aabb* boxes, std::vector<ProxyId>& left);
    Aabb limitsOf(std::uint32_t leaf) const noexcept;
    void refitInner() noexcept;
    Aabb bounds(int level, std::uint32_t node) const noexcept;
    bool setBounds(int level, std::uint32_t node, const Aabb& box) noexcept;
    WideNode& node(int level, std::uint32_t index) noexcept { return m_nodes[m_levelStart[level] + index]; }

    const QueryKernels& m_kernels;
    std::vector<WideNode> m_nodes;  // leaves first, the root last
    std::vector<ProxyId> m_rows;
    std::uint32_t m_levelStart[kMaxWideLevels + 1] = {};
    int m_levelCount = 0;
    BoxTreeView m_view = {};  // points into the two vectors
    std::uint32_t m_rowCount = 0;
    Aabb m_rootBounds = kEmptyAabb;
    double m_leafArea = 0.0;
    double m_leafAreaAtBuild = 0.0;
    float m_meanLeafSize = 0.0f;  // mean leaf size: how far a box may extend beyond a smaller leaf
};
}  // namespace cullet
