// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Columns that are kept from update to update. Most boxes stay in their cells and nearly in their order, so that
// neither the hash nor a full sort is needed: columns are read in the order of the last update, boxes that left a
// cell are dropped on the way, and only the few migrated boxes are inserted by hash.
#include "cullet/broad/grid/columns/cell_bounds.h"
#include "cullet/broad/grid/columns/column_grid.h"

#include <algorithm>
#include <cstring>

namespace cullet
{
namespace
{
constexpr std::size_t kCompareGrain = 4096;
constexpr std::size_t kCompareBlock = 512;
// Boxes are prefetched so many iterations early.
constexpr std::size_t kMigratedAhead = 32;
// Followed scans do not measure sizes and spans; after so many of them a refill checks the plan.
constexpr std::uint32_t kLongestFollow = 128;
// Nor is the plan checked before so many, should its prediction stay wrong: a refill in every update would cost more.
constexpr std::uint32_t kShortestFollow = 8;

/// The float of a rank, an integer in the order of all floats.
Float4 floatOfRank(Int4 rank)
{
    const Int4 bits = rank ^ ((rank >> 31) & 0x7fffffff);
    Float4 value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

/// The lowest finite face that lies in the given cell or a higher one, or infinity, lane by lane; by bisection.
Float4 facesFrom(Int4 cells, const CellBounds& cellBounds)
{
    constexpr std::int32_t kInfinity = 0x7f800000;  // rank of infinity; the lowest float has -kInfinity
    Int4 below = Int4{} - kInfinity;
    Int4 rank = Int4{} + kInfinity;
    // Invariant: the rank of the result is in (below, rank], up to the ends.
    for (int step = 0; step < 32; ++step)
    {
        // The mean, without overflow.
        const Int4 middle = (below & rank) + ((below ^ rank) >> 1);
        const Int4 isThere = cellsOfFaces(floatOfRank(middle), cellBounds) >= cells;
        rank = isThere ? middle : rank;
        below = isThere ? below : middle;
    }
    return floatOfRank(rank);
}
}  // namespace

/// Compares block by block, so that a task needs room for the migrated boxes of a block only.
void ColumnGrid::compareRange(const MotionSource& source, const std::uint32_t* rows, std::size_t count,
                              GridMotion& motion) const
{
    std::array<std::uint32_t, kCompareBlock> migrated;
    MotionSums sums = {motion.octaves.data(), migrated.data()};
    for (std::size_t begin = 0; begin < count; begin += kCompareBlock)
    {
        const std::size_t size = std::min(kCompareBlock, count - begin);
        m_kernels.compareBoxes(source, rows + begin, static_cast<std::uint32_t>(size), sums);
        motion.migrated.insert(motion.migrated.end(), migrated.begin(),
                               migrated.begin() + sums.migratedCount);
    }
    motion.largest = sums.largest;
}

void ColumnGrid::compare(const Aabb* boxes, const Aabb* before, const std::uint32_t* dirty,
                         std::uint32_t dirtyCount, float limit, GridMotion& motion, float* motions)
{
    const unsigned tasks = m_workers.tasksFor(dirtyCount, kCompareGrain);
    m_motions.resize(std::max<std::size_t>(m_motions.size(), tasks));
    const CellBounds cellBounds = cellBoundsOf(m_cellSkin, 0);
    const MotionSource source = {boxes, before, plan().sweepAxis, cellBounds.grow, cellBounds.inverseWidth,
                                 limit, motions};
    m_workers.run(tasks,
                  [&](unsigned task)
                  {
                      GridMotion& own = m_motions[task];
                      own.octaves = {};
                      own.migrated.clear();
                      const TaskRange range(dirtyCount, task, tasks);
                      compareRange(source, dirty + range.begin, range.end - range.begin, own);
                  });
    motion.octaves = {};
    motion.migrated.clear();
    motion.largest = 0;
    for (unsigned task = 0; task < tasks; ++task)
    {
        const GridMotion& own = m_motions[task];
        for (std::size_t octave = 0; octave < own.octaves.size(); ++octave)
            motion.octaves[octave] += own.octaves[octave];
        motion.largest = std::max(motion.largest, own.largest);
        motion.migrated.insert(motion.migrated.end(), own.migrated.begin(), own.migrated.end());
    }
}

/// Computes the edges of a cell once, in the task that scans its column.
const CellEdges& ColumnGrid::edgesOf(std::uint32_t column)
{
    CellEdges& edges = m_edges[column];
    if (m_hasEdges[column] == 0)
    {
        const std::uint64_t cell = m_columns.cell(column);
        const std::int32_t j = cellCoordinateJ(cell);
        const std::int32_t k = cellCoordinateK(cell);
        const CellBounds cellBounds = cellBoundsOf(m_cellSkin, 0);
        const Float4 low = facesFrom(Int4{j, j, k, k}, cellBounds);
        const Float4 high = facesFrom(Int4{j + 1, j + 1, k + 1, k + 1}, cellBounds);
        std::memcpy(edges.low, &low, sizeof low);
        std::memcpy(edges.high, &high, sizeof high);
        m_hasEdges[column] = 1;
    }
    return edges;
}

bool ColumnGrid::addToColumn(std::uint64_t cell, std::uint32_t proxyRow)
{
    const std::uint32_t column = m_columns.findOrInsert(cell);
    if (column == ColumnHash::kNone)
        return false;
    ColumnList& list = m_bold[column];
    if (list.count == list.room)
    {
        const std::uint32_t room = (list.count + list.count / 4 + 8) & ~3u;
        if (m_boldRowsUsed + room + kColumnPadding > m_boldRows.size())
            return false;
        std::copy_n(m_boldRows.begin() + list.begin, list.count, m_boldRows.begin() + m_boldRowsUsed);
        list = {m_boldRowsUsed, list.count, room, list.sortedCount};
        m_boldRowsUsed += room;
    }
    // The flags are computed when the column is scanned.
    m_boldRows[list.begin + list.count++] = proxyRow;
    return true;
}

/// Inserts a migrated box into its new cells; returns false when the grid has to be refilled for it.
bool ColumnGrid::insertMigrated(const GridInput& input, const Aabb& before, std::uint32_t proxyRow)
{
    const Aabb& box = input.boxes[proxyRow];
    const CellBounds cellBounds = cellBoundsOf(input.cellSkin, 0);
    const BoxKind kind = kindOf(box, input.grow);
    const CellRect cells = kind == BoxKind::Bounded ? cellsOf(box, cellBounds) : CellRect{0, -1, 0, -1};
    const bool wasUnbounded = std::binary_search(m_unbounded.begin(), m_unbounded.end(), proxyRow);
    const bool isUnbounded = kind == BoxKind::Unbounded || areTooManyCells(cells);
    if (wasUnbounded || isUnbounded)
        return wasUnbounded && isUnbounded;
    const bool wasThere = kindOf(before, input.grow) == BoxKind::Bounded;
    const CellRect old = wasThere ? cellsOf(before, cellBounds) : CellRect{0, -1, 0, -1};
    for (std::int32_t j = cells.j0; j <= cells.j1; ++j)
    {
        for (std::int32_t k = cells.k0; k <= cells.k1; ++k)
        {
            if (!old.contains(j, k) && !addToColumn(packCell(0, j, k), proxyRow))
                return false;
        }
    }
    return true;
}

bool ColumnGrid::follow(const GridInput& input, const Aabb* before,
                        const std::vector<std::uint32_t>& migrated)
{
    if (!canFollow(input.cellSkin) || ++m_followedScans > kLongestFollow)
        return false;
    if (m_followedScans == 1)
    {
        m_edges.resize(m_columns.capacity());
        m_hasEdges.assign(m_columns.capacity(), 0);
    }
    m_isFollowable = false;
    for (std::size_t i = 0; i < migrated.size(); ++i)
    {
        const std::uint32_t ahead = migrated[std::min(i + kMigratedAhead, migrated.size() - 1)];
        prefetchBox(input.boxes + ahead);
        prefetchBox(before + ahead);
        if (!insertMigrated(input, before[migrated[i]], migrated[i]))
            return false;
    }
    m_isFollowable = true;
    return true;
}

void ColumnGrid::scanFollowed(const GridInput& input, PairSink& sink)
{
    scanColumns({input, sink, ColumnUse::Follow, true});
    m_entryCount = 0;
    for (const ColumnList& list : m_bold)
        m_entryCount += list.count;
    if (m_planner.learnDensity(m_entryCount, m_testCount) && m_followedScans >= kShortestFollow)
        m_isFollowable = false;
}

void ColumnGrid::scanAgain(const GridInput& input, PairSink& sink)
{
    scanColumns({input, sink, ColumnUse::Follow, false});
}
}  // namespace cullet
