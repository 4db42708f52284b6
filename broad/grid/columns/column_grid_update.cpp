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
constexpr std::size_t kPrefetch = 32;
// Followed scans do not measure sizes and spans; after so many of them a refill checks the plan.
constexpr std::uint32_t kLongestFollow = 128;

/// The float of a rank, an integer in the order of all floats.
Float4 floatOfRank(Int4 rank)
{
    const Int4 bits = rank ^ ((rank >> 31) & 0x7fffffff);
    Float4 value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

/// The lowest finite face that lies in the given cell or a higher one, lane by lane; by bisection.
Float4 facesFrom(Int4 cells, const CellBounds& rule)
{
    constexpr std::int32_t kLargest =
        0x7f7fffff;  // rank of the largest float; the lowest one has -kLargest - 1
    Int4 below = Int4{} - kLargest - 1;
    Int4 rank = Int4{} + kLargest;
    // Invariant: the rank of the result is in (below, rank], up to the ends.
    for (int step = 0; step < 32; ++step)
    {
        // The mean, without overflow.
        const Int4 middle = (below & rank) + ((below ^ rank) >> 1);
        const Int4 isThere = cellsOfFaces(floatOfRank(middle), rule) >= cells;
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
    std::array<std::uint32_t, kCompareBlock> strays;
    MotionSums sums = {motion.octaves.data(), strays.data()};
    for (std::size_t begin = 0; begin < count; begin += kCompareBlock)
    {
        const std::size_t size = std::min(kCompareBlock, count - begin);
        m_kernels.compareBoxes(source, rows + begin, static_cast<std::uint32_t>(size), sums);
        motion.strays.insert(motion.strays.end(), strays.begin(), strays.begin() + sums.strayCount);
    }
    motion.largest = sums.largest;
}

void ColumnGrid::compare(const Aabb* boxes, const Aabb* before, const std::uint32_t* dirty,
                         std::uint32_t dirtyCount, float limit, GridMotion& motion, float* motions)
{
    const unsigned tasks = m_workers.tasksFor(dirtyCount, kCompareGrain);
    m_motions.resize(std::max<std::size_t>(m_motions.size(), tasks));
    const CellBounds rule = ruleOf(m_reach, 0);
    const MotionSource source = {boxes, before, m_plan.sweepAxis, rule.grow, rule.inverseWidth,
                                 limit, motions};
    m_workers.run(tasks,
                  [&](unsigned task)
                  {
                      GridMotion& own = m_motions[task];
                      own.octaves = {};
                      own.strays.clear();
                      const TaskRange range(dirtyCount, task, tasks);
                      compareRange(source, dirty + range.begin, range.end - range.begin, own);
                  });
    motion.octaves = {};
    motion.strays.clear();
    motion.largest = 0;
    for (unsigned task = 0; task < tasks; ++task)
    {
        const GridMotion& own = m_motions[task];
        for (std::size_t octave = 0; octave < own.octaves.size(); ++octave)
            motion.octaves[octave] += own.octaves[octave];
        motion.largest = std::max(motion.largest, own.largest);
        motion.strays.insert(motion.strays.end(), own.strays.begin(), own.strays.end());
    }
}

/// Computes the edges of a cell once, in the task that scans its column.
const CellEdges& ColumnGrid::edgesOf(std::uint32_t row)
{
    CellEdges& edges = m_edges[row];
    if (m_hasEdges[row] == 0)
    {
        const std::uint64_t cell = m_rows.cell(row);
        const std::int32_t j = cellCoordinateJ(cell);
        const std::int32_t k = cellCoordinateK(cell);
        const CellBounds rule = ruleOf(m_reach, 0);
        const Float4 low = facesFrom(Int4{j, j, k, k}, rule);
        const Float4 high = facesFrom(Int4{j + 1, j + 1, k + 1, k + 1}, rule);
        std::memcpy(edges.low, &low, sizeof low);
        std::memcpy(edges.high, &high, sizeof high);
        m_hasEdges[row] = 1;
    }
    return edges;
}

bool ColumnGrid::addToRow(std::uint64_t cell, std::uint32_t id)
{
    const std::uint32_t row = m_rows.findOrInsert(cell);
    if (row == ColumnHash::kNone)
        return false;
    RowList& list = m_bold[row];
    if (list.count == list.room)
    {
        const std::uint32_t room = (list.count + list.count / 4 + 8) & ~3u;
        if (m_idsUsed + room + kRowPadding > m_boldIds.size())
            return false;
        std::copy_n(m_boldIds.begin() + list.begin, list.count, m_boldIds.begin() + m_idsUsed);
        list = {m_idsUsed, list.count, room, list.sortedCount};
        m_idsUsed += room;
    }
    // The flags are computed when the column is scanned.
    m_boldIds[list.begin + list.count++] = id;
    return true;
}

/// Inserts a migrated box into its new cells; returns false when the grid has to be refilled for it.
bool ColumnGrid::followStray(const GridInput& input, const Aabb& before, std::uint32_t id)
{
    const Aabb& box = input.boxes[id];
    const CellBounds rule = ruleOf(input.reach, 0);
    const BoxKind kind = kindOf(box, input.grow);
    const TileRange cells = kind == BoxKind::Bounded ? cellsOf(box, rule) : TileRange{0, -1, 0, -1};
    const bool wasUnbounded = std::binary_search(m_unbounded.begin(), m_unbounded.end(), id);
    const bool isUnbounded = kind == BoxKind::Unbounded || isManyCells(cells);
    if (wasUnbounded || isUnbounded)
        return wasUnbounded && isUnbounded;
    const bool wasThere = kindOf(before, input.grow) == BoxKind::Bounded;
    const TileRange old = wasThere ? cellsOf(before, rule) : TileRange{0, -1, 0, -1};
    for (std::int32_t j = cells.j0; j <= cells.j1; ++j)
    {
        for (std::int32_t k = cells.k0; k <= cells.k1; ++k)
        {
            if (!old.contains(j, k) && !addToRow(packCell(0, j, k), id))
                return false;
        }
    }
    return true;
}

bool ColumnGrid::follow(const GridInput& input, const Aabb* before, const std::vector<std::uint32_t>& strays)
{
    if (!canFollow(input.reach) || ++m_followedScans > kLongestFollow)
        return false;
    if (m_followedScans == 1)
    {
        m_edges.resize(m_rows.capacity());
        m_hasEdges.assign(m_rows.capacity(), 0);
    }
    m_isFollowable = false;
    for (std::size_t i = 0; i < strays.size(); ++i)
    {
        const std::uint32_t ahead = strays[std::min(i + kPrefetch, strays.size() - 1)];
        prefetchBox(input.boxes + ahead);
        prefetchBox(before + ahead);
        if (!followStray(input, before[strays[i]], strays[i]))
            return false;
    }
    m_isFollowable = true;
    return true;
}

void ColumnGrid::scanFollowed(const GridInput& input, PairSink& sink)
{
    scanRows({input, sink, RowUse::Follow, true});
    m_entryCount = 0;
    for (const RowList& list : m_bold)
        m_entryCount += list.count;
    if (m_options.cellScale <= 0)
        learnDensity();
}

void ColumnGrid::scanAgain(const GridInput& input, PairSink& sink)
{
    scanRows({input, sink, RowUse::Follow, false});
}
}  // namespace cullet
