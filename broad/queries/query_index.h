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
struct QuerySide;

/// A ray, or a box swept along a ray, in world space; the parameters of Bullet's box test as they are.
///
/// A box [min, max] is hit when the ray meets [min - growMax, max - growMin] with an entry before lambdaMax and an exit
/// behind 0 (slab test, per axis (plane - origin) * inverseDirection).
struct RaySegment
{
    double origin[3];
    /// 1 / direction; +-1e18, +-1e30 or infinite along an axis to which the ray is parallel.
    double inverseDirection[3];
    double lambdaMax;  ///< length in units of the direction; 0 asks for boxes around the origin
    double growMin[3] = {0.0, 0.0, 0.0};  ///< lower corner of the swept box relative to the origin
    double growMax[3] = {0.0, 0.0, 0.0};  ///< upper corner; need not be -growMin
};

/// How a QueryIndex answers; the rows that it visits are candidates for the same set in every mode.
enum class QueryMode
{
    Automatic,  ///< scans while few queries come, the trees when they pay for their upkeep
    Scan,       ///< always scans all boxes
    Tree        ///< always brings the trees up to date first
};

struct QueryOptions
{
    QueryMode mode = QueryMode::Automatic;
    /// Slow-path switch for tests and comparisons: use no instructions beyond the x86-64 baseline.
    bool baselineSimd = false;
};

/// Where a query stands; lives on the stack of the caller, so that queries nest and run side by side.
struct QueryCursor
{
    enum class Stage
    {
        Main,    ///< the tree over most rows
        Beside,  ///< the small tree over rows that came or jumped since the big one was built
        Listed,  ///< rows that came or jumped since then too, and those that reach beyond every tree
        Scan,    ///< all rows, without a tree
        Done
    };
    Stage stage = Stage::Done;
    bool isRay = false;
    std::uint32_t position = 0;
    TreeCursor tree;
    Aabb box;
    Aabb finiteBox;  ///< what of `box` a bounded box can meet
    RayQuery ray;
    const QuerySide* side = nullptr;  ///< what there is beside the main tree

    /// Begins a stage; above the root stands a node whose only child is the root.
    void enter(Stage next) noexcept
    {
        stage = next;
        position = 0;
        tree.depth = 1;
        tree.nodes[0] = 0;
        tree.pending[0] = 1;
    }
};

/// Finds the rows of a ProxyTable that a box or a ray may touch, always by the boxes that the table holds right now.
///
/// Candidates are a superset of the exact answer: the caller tests the exact box. Each row comes at most once; empty
/// boxes never come. The order depends only on the history of the table and of the queries, as long as one thread asks.
///
/// Changes of the table cost nothing here. The first query after a few changes takes them into a tree of boxes, O(log n)
/// each; boxes that came or jumped go on a list, which queries scan until that has cost as much as a small tree over
/// them. After many changes, the first queries scan all boxes, until they have cost as much as bringing the tree up to
/// date. So no history costs more than about twice the better of two ways. Boxes that reach beyond 1e15 stay on the list.
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

    /// Memory held beside the table, bytes.
    std::uint64_t bytes() const;

    /// Times that the tree was built anew, and times that it took in changes.
    std::uint64_t buildsTotal() const;
    std::uint64_t syncsTotal() const;

    /// Rows that queries tested one by one, other than those that are always listed; and rows that went into new trees.
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
    void startRay(const RaySegment& ray, QueryCursor& cursor) const;
    std::uint32_t next(QueryCursor& cursor, ProxyId* rows) const;

    std::unique_ptr<State> m_state;
};
}  // namespace cullet
