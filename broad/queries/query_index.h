// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/broad/queries/query_kernels.h"

#include <cstdint>
#include <memory>
#include <utility>

namespace cullet
{
struct SecondaryRows;

/// A ray, or a box swept along a ray, in world space: the unchanged parameters of Bullet's box test.
///
/// A box [min, max] is hit when the ray intersects [min - growMax, max - growMin] with an entry before lambdaMax and an
/// exit after 0 (slab test, per axis (plane - origin) * inverseDirection).
struct RaySegment
{
    double origin[3];
    /// 1 / direction; +-1e18, +-1e30 or infinite along an axis to which the ray is parallel.
    double inverseDirection[3];
    double lambdaMax;  ///< length in units of the direction; 0 finds boxes around the origin
    double growMin[3] = {0.0, 0.0, 0.0};  ///< lower corner of the swept box relative to the origin
    double growMax[3] = {0.0, 0.0, 0.0};  ///< upper corner; need not be -growMin
};

/// How a QueryIndex finds rows; the rows that it visits are candidates for the same set in every mode.
enum class QueryMode
{
    Automatic,  ///< scans while queries are few, uses the trees when that pays for their updates
    Scan,       ///< always scans all boxes
    Tree        ///< always brings the trees up to date first
};

struct QueryOptions
{
    QueryMode mode = QueryMode::Automatic;
    /// Slow-path switch for tests and comparisons: use no instructions beyond the x86-64 baseline.
    bool baselineSimd = false;
};

/// Position of a query; stored on the stack of the caller, so that queries can nest and run concurrently.
struct QueryCursor
{
    enum class Stage
    {
        Main,        ///< the tree over most rows
        SecondTree,  ///< the second tree, over rows created or teleported since the main one was built
        Listed,      ///< further rows created or teleported since then, and rows too large for trees
        Scan,        ///< all rows, without a tree
        Done
    };
    Stage stage = Stage::Done;
    bool isRay = false;
    std::uint32_t position = 0;
    TreeCursor tree;
    Aabb box;
    Aabb finiteBox;  ///< the part of `box` that bounded boxes can overlap
    RayQuery ray;
    const SecondaryRows* secondary = nullptr;  ///< rows outside the main tree

    /// Begins a stage, at a virtual node above the root whose only child is the root.
    void enter(Stage next) noexcept
    {
        stage = next;
        position = 0;
        tree.depth = 1;
        tree.nodes[0] = 0;
        tree.pending[0] = 1;
    }
};

/// Finds the rows of a ProxyTable that a box or a ray may touch, always by the current boxes of the table.
///
/// Candidates are a superset of the exact result: the caller tests the exact box. Each row is visited at most once,
/// rows with empty boxes never. If one thread runs all queries, the order depends only on the history of the table and
/// of the queries.
///
/// Changes of the table cost nothing here. The first query after a few changes applies them to a tree of boxes, each in
/// O(log n); boxes that were created or teleported are put on a list, which queries scan until that has cost as much as
/// a small tree over them. After many changes, the first queries scan all boxes, until that has cost as much as
/// updating the tree. So no history costs more than about twice the better of the two. Boxes that extend beyond 1e15
/// stay on the list.
///
/// Threads: any number of queries at the same time, also from inside visit(), as long as the table does not change
/// meanwhile. One index per table, because it consumes ProxyTable::collectQueryChanges().
class QueryIndex
{
public:
    explicit QueryIndex(ProxyTable& table, const QueryOptions& options = {});
    ~QueryIndex();
    QueryIndex(const QueryIndex&) = delete;
    QueryIndex& operator=(const QueryIndex&) = delete;

    /// Calls visit(row) for every row whose box overlaps `box` (closed intervals); infinite sides are legal.
    template <class Visit>
    void forEachOverlap(const Aabb& box, Visit&& visit) const
    {
        QueryCursor cursor;
        startOverlap(box, cursor);
        drain(cursor, visit);
    }

    /// forEachOverlap() by ascending row, and without a tree: for boxes that overlap a large share of the rows.
    template <class Visit>
    void scanOverlap(const Aabb& box, Visit&& visit) const
    {
        QueryCursor cursor;
        startScan(box, cursor);
        drain(cursor, visit);
    }

    /// Calls visit(row) for every row whose grown box the ray may hit between 0 and lambdaMax.
    ///
    /// Covers everything that Bullet's slab test (btRayAabb2, in float or double) reports. A NaN in x or in lambdaMax
    /// hits nothing, as there; with other numbers that float cannot bound, every valid row is visited.
    template <class Visit>
    void forEachOnRay(const RaySegment& ray, Visit&& visit) const
    {
        QueryCursor cursor;
        startRay(ray, cursor);
        drain(cursor, visit);
    }

    /// Whether queries should ask a RowSource instead: a tree is not up to date, and they have not asked for more
    /// since the last update than bringing it up to date costs.
    ///
    /// @param update number of the update that the source knows; costs are counted anew in each
    bool prefersSource(std::uint64_t update) const;
    /// Counts what a query of the source cost.
    void countSource(std::uint32_t cost) const;

    /// Memory held beside the table, bytes.
    std::uint64_t bytes() const;

    /// Times that the tree was rebuilt, and times that it was updated.
    std::uint64_t buildsTotal() const;
    std::uint64_t syncsTotal() const;

    /// Rows that queries tested one by one, other than those that are always listed; and rows that were put into new
    /// trees.
    std::uint64_t scannedRowsTotal() const;
    std::uint64_t builtRowsTotal() const;

private:
    struct State;

    template <class Visit>
    void drain(QueryCursor& cursor, Visit& visit) const
    {
        ProxyId rows[kQueryBatch];
        while (const std::uint32_t count = next(cursor, rows))
        {
            for (std::uint32_t i = 0; i < count; ++i)
                visit(rows[i]);
        }
    }

    void startOverlap(const Aabb& box, QueryCursor& cursor) const;
    void startScan(const Aabb& box, QueryCursor& cursor) const;
    void startRay(const RaySegment& ray, QueryCursor& cursor) const;
    std::uint32_t next(QueryCursor& cursor, ProxyId* rows) const;

    std::unique_ptr<State> m_state;
};
}  // namespace cullet
