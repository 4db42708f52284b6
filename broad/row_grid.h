// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/aabb.h"
#include "broad/backend.h"
#include "broad/grid_plan.h"
#include "broad/row_builder.h"
#include "broad/row_directory.h"
#include "broad/row_soa.h"
#include "broad/worker_pool.h"

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

    /// @param worker below WorkerPool::threads(); calls with the same worker never run at the same time
    virtual void take(unsigned worker, const IdPair* pairs, std::uint32_t count) = 0;
};

/// The boxes to be put into the grid.
struct GridInput
{
    const Aabb* boxes;         ///< row of the proxy table -> box
    const std::uint32_t* ids;  ///< [count] rows to take, or null for 0 .. count - 1
    std::uint32_t count;
    float grow;                  ///< every box is grown by this on every side first
    float deepGap = kReportAll;  ///< pairs with a gap (negative: overlap) not above this are left out
};

/// The lecture's hierarchical grid with spatial hashing, laid out as rows.
///
/// Lecture 4, Broad Phase: every object has a resolution Res(A) by its size; it is stored "bold" in the cells it
/// touches at its own level and "regular" in those of all coarser levels; a pair is reported at the level min(Res) as
/// bold x bold or bold x regular, and cells live in a hash of buckets, so that the world is unbounded. What differs:
/// a cell is cut along two axes only and keeps its boxes sorted along the third (a *row*), where an 8-wide forward
/// sweep replaces the test of all ids in a cell; octaves of sizes share a level when the cost model says so; and
/// regular ids go only into rows that hold a bold one, since no other row can report a pair of theirs. Each pair is
/// reported once, by the row that holds the corner (max of minima) of the two boxes.
///
/// Boxes that reach more than 2^50, or would touch too many cells, are tested against everything instead.
class RowGrid
{
public:
    RowGrid(const GridOptions& options, WorkerPool& workers);

    /// Clears the grid, fills it and hands every overlapping pair of the input to the sink, each exactly once.
    ///
    /// @param keep whether the bold rows stay, for query()
    /// Cost: O(n + pairs) for sizes within a constant ratio; about 40 ns a box on one core
    void scan(const GridInput& input, PairSink& sink, bool keep);

    /// Hands every kept box that overlaps `box` to the sink as {id, other}, each once; scan(keep) came before.
    ///
    /// `box` itself should not be kept under `id`, or it is reported too. Safe from several threads with different
    /// workers.
    void query(const Aabb& box, std::uint32_t id, unsigned worker, PairSink& sink) const;

    /// What the last scan did.
    std::uint64_t entryCount() const { return m_entryCount; }
    std::uint64_t testCount() const { return m_testCount; }
    std::uint32_t levelCount() const { return m_plan.levelCount; }
    const std::vector<std::uint32_t>& unbounded() const { return m_unbounded; }
    std::uint64_t bytes() const;

private:
    struct Entry
    {
        std::uint32_t row;
        FlaggedId id;
    };

    /// A vector whose room is made once per box instead of being checked per entry.
    class EntryList
    {
    public:
        void clear() { m_count = 0; }
        void makeRoom(std::size_t entries)
        {
            if (m_count + entries > m_entries.size())
                m_entries.resize(2 * m_entries.size() + entries + 1024);
        }
        void push(Entry entry) { m_entries[m_count++] = entry; }
        const Entry* begin() const { return m_entries.data(); }
        const Entry* end() const { return m_entries.data() + m_count; }
        std::uint64_t bytes() const { return m_entries.capacity() * sizeof(Entry); }

    private:
        std::vector<Entry> m_entries;
        std::size_t m_count = 0;
    };

    /// What one task of the filling pass writes; merged afterwards.
    struct Task
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
    struct Worker
    {
        RowBuilder builder;
        RowPool bold;
        RowPool regular;
        std::unique_ptr<PairBuffer> buffer = std::make_unique<PairBuffer>();
    };

    struct CellRange
    {
        std::int32_t j0, j1, k0, k1;
    };

    /// A box that is to be inserted.
    struct Located
    {
        CellRange cells;
        std::uint32_t id;
        std::int32_t level;
    };

    std::uint32_t locate(const GridInput& input, std::uint32_t begin, std::uint32_t end, Task& task,
                         Located* block) const;
    static Aabb grown(const Aabb& box, float grow);
    static std::int64_t cellCountOf(const CellRange& cells);
    CellRange cellsOf(const Aabb& box, std::uint32_t level) const;
    std::size_t octaveIndex(const Aabb& box) const;
    void recordSize(const Aabb& box, std::size_t octave, Task& task) const;
    bool insertBold(std::uint32_t id, const CellRange& cells, std::int32_t level, Task& task);
    enum class BoxKind
    {
        Empty,
        Bounded,
        Unbounded  ///< some extent beyond the highest octave
    };
    static BoxKind kindOf(const Aabb& box, float grow);

    void preparePlan(const GridInput& input);
    void makePlan(const GridInput& input, const SizeHistogram& sizes);
    bool isPlanStale(const SizeHistogram& sizes) const;
    void learnDensity();
    void fill(const GridInput& input);
    bool tryFill(const GridInput& input);
    void fillBold(const GridInput& input, std::uint32_t begin, std::uint32_t end, Task& task);
    void fillRegular(const GridInput& input, std::uint32_t begin, std::uint32_t end, Task& task);
    void mergeTasks();
    void scatterKind(EntryList Task::*entries, std::vector<std::uint32_t> Task::*counts,
                     std::vector<std::uint32_t>& offsets, std::vector<FlaggedId>& ids);
    void scanRows(const GridInput& input, PairSink& sink, bool keep);
    void scanRow(const GridInput& input, std::uint32_t row, unsigned worker, bool keep, PairBuffer& out);
    void scanUnbounded(const GridInput& input, PairSink& sink);
    void queryLevel(const RowSoa& query, const Aabb& box, std::uint32_t level, PairBuffer& out) const;
    void queryRow(const RowSoa& query, std::uint32_t row, PairBuffer& out) const;

    GridOptions m_options;
    WorkerPool& m_workers;
    const RowKernels& m_kernels;
    GridPlan m_plan;
    SizeHistogram m_planned;  // sizes that the plan was made for
    double m_density = 1;
    bool m_hasPlan = false;
    RowDirectory m_rows;
    std::uint32_t m_rowRoom = 256;
    unsigned m_taskCount = 1;
    std::vector<Task> m_tasks;
    std::vector<Worker> m_scratch;
    std::vector<std::uint32_t> m_boldOffsets;     // [rows + 1] into m_boldIds
    std::vector<std::uint32_t> m_regularOffsets;  // [rows + 1] into m_regularIds
    std::vector<FlaggedId> m_boldIds;
    std::vector<FlaggedId> m_regularIds;
    std::vector<std::uint32_t> m_unbounded;  // ascending
    mutable RowPool m_kept;                  // bold rows, at m_boldOffsets[row] + row
    std::vector<float> m_longest;            // [rows] longest sweep extent in a kept row
    std::uint64_t m_entryCount = 0;
    std::uint64_t m_testCount = 0;
};
}  // namespace cullet
