// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/broad/aabb.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/broad/cell_visitor.h"
#include "cullet/broad/grid/columns/cell_bounds.h"
#include "cullet/broad/grid/columns/column_builder.h"
#include "cullet/broad/grid/columns/column_hash.h"
#include "cullet/broad/grid/columns/column_soa.h"
#include "cullet/broad/grid/columns/grid_planner.h"
#include "cullet/broad/row_source.h"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace cullet
{
/// Receives overlapping pairs from the grid, in batches, from several threads at once.
class PairSink
{
public:
    virtual ~PairSink() = default;

    /// @param worker below ParallelLoops::threads(); calls with the same worker never run at the same time
    virtual void take(unsigned worker, const PairBuffer& found) = 0;
};

/// The boxes to be put into the grid.
struct GridInput
{
    const Aabb* boxes = nullptr;               ///< [rows of the ProxyTable]
    const std::uint32_t* proxyRows = nullptr;  ///< [count] rows to take, or null for 0 .. count - 1
    std::uint32_t count = 0;
    float grow = 0;      ///< enlarges every box on every side
    float cellSkin = 0;  ///< enlarges every box further, for the choice of its cells only
    float maxGap = 0;  ///< pairs with a gap (negative: overlap) above this are left out; at most 2 * cellSkin
    float minGap = kNoMinGap;  ///< pairs with a gap not above this are left out
    /// [rows] or null: the motion of each box; times motionFactor it is the bound of the box, at most maxGap / 2. Pairs
    /// whose absolute gap is above the sum of both bounds are left out.
    const float* motions = nullptr;
    float motionFactor = 0;
};

/// What the columns are used for after their scan.
enum class ColumnUse : std::uint8_t
{
    Once,
    Query,  ///< query()
    Follow  ///< compare() and follow()
};

/// How the changed boxes moved since the last scan.
struct alignas(64) GridMotion
{
    /// Boxes by the exponent of the largest motion of a face; created, destroyed and infinite boxes count in the
    /// last.
    std::array<std::uint32_t, 256> octaves{};
    float largest = 0;                    ///< motion within the limit
    std::vector<std::uint32_t> migrated;  ///< ascending; touch other cells than before, or moved farther
};

/// Hierarchical grid with spatial hashing of "Lesson 04, Broad Phase Collision Detection" (docs/references.md), laid
/// out as columns.
///
/// In Lesson 04 every object has a resolution Res(A) by its size. It is stored "bold" in the cells that it touches at
/// its own level and "regular" in those of all coarser levels. A pair is reported at the level min(Res), as bold x
/// bold or bold x regular. Cells are hashed into buckets, so that the world is unbounded. The differences are:
/// - A cell is bounded along two axes only and its boxes are sorted along the third (a *column*). There an 8-wide
///   forward sweep replaces the test of all boxes in a cell.
/// - Octaves of sizes share a level where the cost model finds that cheaper.
/// - Regular boxes are stored only in columns that hold a bold one, since no other column can report a pair of
///   theirs.
///
/// Each pair is reported once, by the column that holds the corner (max of minima) of the two boxes. Boxes with an
/// extent above 2^50, or that would touch too many cells, are tested against all boxes instead.
class ColumnGrid
{
public:
    /// Boxes that are worth a task of their own where the grid is filled.
    static constexpr std::size_t kTaskGrain = 4096;

    ColumnGrid(const GridOptions& options, ParallelLoops& workers);

    /// Clears the grid, fills it and hands every overlapping pair of the input to the sink, each exactly once.
    ///
    /// Cost: O(n + pairs) for sizes within a constant ratio; about 80 ns a box on one core
    void scan(const GridInput& input, PairSink& sink, ColumnUse use);

    /// Whether scan() of `count` boxes uses the calling thread only.
    bool isForOneThread(std::uint32_t count) const;

    /// Whether follow() can update the columns of the last scan, so that they need no refill.
    bool canFollow(float cellSkin) const { return m_isFollowable && m_cellSkin == cellSkin; }

    /// Compares all changed boxes with those of the last scan.
    ///
    /// @param before    boxes as of that scan
    /// @param limit     see GridMotion
    /// @param motions   [out, rows] largest motion of a face of each changed box; or null
    void compare(const Aabb* boxes, const Aabb* before, const std::uint32_t* dirty, std::uint32_t dirtyCount,
                 float limit, GridMotion& motion, float* motions = nullptr);

    /// Inserts migrated boxes into their new cells; returns whether scanFollowed() may run next, otherwise scan()
    /// must.
    bool follow(const GridInput& input, const Aabb* before, const std::vector<std::uint32_t>& migrated);

    /// Scans the existing columns instead of refilling them; boxes that left a cell are dropped from it.
    void scanFollowed(const GridInput& input, PairSink& sink);

    /// Hands all pairs that overlapped in the last scan to the sink. The columns do not change.
    ///
    /// @param input the boxes of that scan
    void scanAgain(const GridInput& input, PairSink& sink);

    /// Width of the narrowest cells.
    float narrowestWidth() const { return plan().narrowest; }

    /// Hands every kept box that overlaps one of `boxes` to the sink as {index, kept}, each once, one of `boxes`
    /// after the other. The last scan had ColumnUse::Query.
    ///
    /// Fast where the boxes are in the order of orderAlongColumns(). Several threads may call it, with different
    /// workers.
    ///
    /// @param boxes [count] empty boxes are skipped
    void query(const Aabb* boxes, std::uint32_t count, unsigned worker, PairSink& sink) const;

    /// See RowSource. The boxes are those of the last scan, or lie in them, enlarged as they were, if it had
    /// ColumnUse::Query.
    std::uint32_t findNearRay(const RayPath& ray, const Aabb* boxes, RowSink& sink) const;
    std::uint32_t findNearBox(const Aabb& box, const Aabb* boxes, RowSink& sink) const;

    /// Orders boxes by the columns that they begin in, and along these.
    ///
    /// @param boxes [rows of the ProxyTable]
    /// @return indices into `proxyRows`
    std::vector<std::uint32_t> orderAlongColumns(const Aabb* boxes,
                                                 const std::vector<std::uint32_t>& proxyRows) const;

    /// The box enlarged by `grow` on every side.
    static Aabb grown(const Aabb& box, float grow);

    /// Visits the columns as boxes that are infinite along the sweep axis; see CellSource.
    void forEachCell(const CellVisitor& visit) const;

    /// Counters of work.
    struct Work
    {
        std::uint64_t tests = 0;   ///< box tests by the last scan and all queries
        std::uint64_t visits = 0;  ///< columns that queries searched, counted for each box
    };

    /// Returns the work since the last call and resets the counters.
    Work collectWork();

    /// Columns outside the window that the next scan has a table for; it clears all of them.
    std::uint32_t tableSize() const { return m_columnCapacity; }

    /// Entries of the last scan: boxes times cells.
    std::uint64_t entryCount() const { return m_entryCount; }
    const GridPlan& plan() const { return m_planner.plan(); }
    const std::vector<std::uint32_t>& unbounded() const { return m_unbounded; }
    std::uint64_t bytes() const;

private:
    // A box that would touch more cells than this under a plan that did not expect it joins the unbounded boxes.
    static constexpr std::int64_t kMaxCells = 64;
    static constexpr std::int32_t kSquareSide = 8;  // side of a square of kMaxCells cells
    // Cells that findNearRay() and findNearBox() look into at most.
    static constexpr std::int64_t kMostFindCells = 1024;

    struct Entry
    {
        std::uint32_t column;
        TaggedRow proxyRow;
    };

    /// A vector that is enlarged once per box instead of being checked per entry.
    class EntryList
    {
    public:
        void clear() { m_count = 0; }
        void makeRoom(std::size_t entries)
        {
            if (m_count + entries >= m_entries.size())
                m_entries.resize(2 * m_entries.size() + entries + 1024);
        }
        void push(Entry entry) { m_entries[m_count++] = entry; }
        std::size_t size() const { return m_count; }
        const Entry* begin() const { return m_entries.data(); }
        const Entry* end() const { return m_entries.data() + m_count; }
        Entry* end() { return m_entries.data() + m_count; }
        /// Appends the entries that were written behind the end.
        void setEnd(const Entry* end) { m_count = static_cast<std::size_t>(end - m_entries.data()); }
        std::uint64_t bytes() const { return m_entries.capacity() * sizeof(Entry); }

    private:
        std::vector<Entry> m_entries;
        std::size_t m_count = 0;
    };

    /// What one task of the filling pass writes; merged afterwards.
    struct alignas(64) Task
    {
        EntryList bold;
        EntryList regular;
        std::vector<std::uint32_t> boldCount;
        std::vector<std::uint32_t> regularCount;
        std::vector<std::uint32_t> unbounded;
        SizeHistogram sizes;
        bool isFull = false;
    };

    /// Scratch of one worker of the scanning pass.
    struct alignas(64) Worker
    {
        ColumnBuilder builder;
        ColumnPool bold;
        ColumnPool regular;
        std::unique_ptr<PairBuffer> buffer = std::make_unique<PairBuffer>();
    };

    /// Position of the TaggedRow array of a column; begin and room are multiples of four, so that whole vectors can
    /// be written.
    struct ColumnList
    {
        std::uint32_t begin;
        std::uint32_t count;
        std::uint32_t room;
        std::uint32_t sortedCount;  ///< entries sorted by the last scan; the others were added since
    };

    /// One pass over the columns.
    struct ColumnPass
    {
        const GridInput& input;
        PairSink& sink;
        ColumnUse use;
        bool isFollowed;  ///< boxes may have changed cells
    };

    /// Destination of the pairs of a scan or query.
    struct SinkContext
    {
        PairSink* sink;
        unsigned worker;
    };

    std::uint32_t locate(const GridInput& input, std::uint32_t begin, std::uint32_t end, Task& task,
                         LocatedBox* block) const;
    bool locateOne(const GridInput& input, std::uint32_t index, Task& task, LocatedBox& to) const;
    void sampleSizes(const GridInput& input, std::uint32_t begin, std::uint32_t end, Task& task) const;
    static std::int64_t cellCountOf(const CellRect& cells);
    static bool areTooManyCells(const CellRect& cells)
    {
        const std::int32_t spans = (cells.j1 - cells.j0) | (cells.k1 - cells.k0);
        return spans >= kSquareSide && cellCountOf(cells) > kMaxCells;
    }
    CellBounds cellBoundsOf(float grow, std::uint32_t level) const
    {
        return {grow, plan().inverseWidth[level]};
    }
    Float4 tileOf(const Aabb& box) const;
    CellRect cellsOf(const Aabb& box, const CellBounds& cellBounds) const;
    static std::size_t octaveIndex(Float4 tile);
    void recordSize(const Aabb& grown, Task& task) const;
    void sampleInput(const GridInput& input);
    CellWindow chooseWindow(std::vector<std::int32_t>& js, std::vector<std::int32_t>& ks,
                            std::uint32_t boxes) const;
    bool insertByHash(const LocatedBox& box, Task& task);
    bool insertBold(const LocatedBox* block, std::uint32_t count, Task& task);
    enum class BoxKind
    {
        Empty,
        Bounded,
        Unbounded  ///< some extent beyond the highest octave
    };
    static BoxKind kindOf(const Aabb& box, float grow);

    static SizeHistogram sizesOfSample(const GridInput& input);
    void makePlan(const GridInput& input, const SizeHistogram& sizes);
    void fill(const GridInput& input);
    bool tryFill(const GridInput& input);
    void fillBold(const GridInput& input, std::uint32_t begin, std::uint32_t end, Task& task);
    void fillRegular(const GridInput& input, std::uint32_t begin, std::uint32_t end, Task& task);
    void mergeTasks(ColumnUse use);
    std::uint32_t scatterKind(EntryList Task::*entries, std::vector<std::uint32_t> Task::*counts,
                              std::vector<ColumnList>& lists, std::vector<TaggedRow>& proxyRows,
                              ColumnUse use);
    void scanColumns(const ColumnPass& pass);
    void scanColumn(const ColumnPass& pass, std::uint32_t column, unsigned worker, PairBuffer& out);
    ColumnSoa buildColumn(const ColumnPass& pass, std::uint32_t column, ColumnList& list,
                          std::vector<TaggedRow>& proxyRows, ColumnPool& pool, std::size_t offset,
                          ColumnBuilder& builder);
    void compareRange(const MotionSource& source, const std::uint32_t* rows, std::size_t count,
                      GridMotion& motion) const;
    bool insertMigrated(const GridInput& input, const Aabb& before, std::uint32_t proxyRow);
    bool addToColumn(std::uint64_t cell, std::uint32_t proxyRow);
    const CellEdges& edgesOf(std::uint32_t column);
    static void deliverToSink(void* context, const PairBuffer& found);
    PairBuffer& prepareBuffer(const GridInput& input, SinkContext& context) const;
    void scanUnbounded(const GridInput& input, PairSink& sink);
    void queryBox(const Aabb& box, TaggedRow proxyRow, PairBuffer& out) const;
    void queryLevel(const ColumnSoa& query, const Aabb& box, std::uint32_t level, PairBuffer& out) const;
    void queryColumn(const ColumnSoa& query, std::uint32_t column, PairBuffer& out) const;
    class RowBatch;
    void findInColumn(std::uint32_t column, const Aabb& box, RowBatch& rows) const;
    void findInCells(std::uint32_t level, const CellRect& cells, const Aabb& box, RowBatch& rows) const;
    bool isLongerAlongY(const RayPath& ray) const;
    void followRay(std::uint32_t level, const RayPath& ray, const CellRect& all, RowBatch& rows) const;
    void findUnbounded(const Aabb& box, RowBatch& rows) const;

    std::uint32_t m_bucketCount;  // see GridOptions
    ParallelLoops& m_workers;
    const ColumnKernels& m_kernels;
    GridPlanner m_planner;
    CellWindow m_window;
    float m_sweepLow = 0;  // most boxes begin between the two
    float m_sweepHigh = 0;
    ColumnHash m_columns;
    std::uint32_t m_columnCapacity = 256;
    unsigned m_taskCount = 1;
    std::vector<Task> m_tasks;
    std::vector<Worker> m_scratch;
    std::vector<ColumnList> m_bold;     // [columns] into m_boldRows
    std::vector<ColumnList> m_regular;  // [columns] into m_regularRows; empty with one level
    mutable std::vector<TaggedRow> m_boldRows;
    std::vector<TaggedRow> m_regularRows;
    std::vector<std::uint32_t> m_unbounded;  // ascending
    mutable ColumnPool m_kept;               // bold columns, at their offsets in m_boldRows
    std::vector<float>
        m_longestExtents;            // [columns] longest sweep extent, unless scanned for ColumnUse::Once
    std::vector<CellEdges> m_edges;  // [columns] while they are followed
    std::vector<std::uint8_t> m_hasEdges;  // [columns]
    std::vector<GridMotion> m_motions;     // [tasks]
    std::uint32_t m_boldRowsUsed = 0;      // entries used of m_boldRows
    float m_cellSkin = 0;                  // of the last scan
    bool m_isFollowable = false;
    ColumnUse m_use = ColumnUse::Once;  // of the last scan
    std::uint32_t m_followedScans = 0;  // since the last fill
    std::uint64_t m_entryCount = 0;
    std::uint64_t m_testCount = 0;
};
}  // namespace cullet
