// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/row_grid.h"

#include "broad/aabb_simd.h"
#include "broad/cell_rule.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cullet
{
namespace
{
// Sizes are recorded of every so-manieth box only, and of all that do not fit the plan.
constexpr std::uint32_t kSizeSampling = 8;
constexpr std::uint32_t kLocateBlock = 128;
constexpr std::size_t kTaskGrain = 4096;
constexpr std::uint32_t kRowsPerTask = 16;
constexpr std::uint32_t kShortestFollow = 8;

struct SinkContext
{
    PairSink* sink;
    unsigned worker;
};

void handToSink(void* context, const PairBuffer& found)
{
    const SinkContext& to = *static_cast<SinkContext*>(context);
    to.sink->take(to.worker, found);
}

FlaggedId flagged(std::uint32_t id, bool startsY, bool startsZ)
{
    return id | (startsY ? kStartsHereY : 0u) | (startsZ ? kStartsHereZ : 0u);
}
}  // namespace

RowGrid::RowGrid(const GridOptions& options, WorkerPool& workers)
    : m_options(options),
      m_workers(workers),
      m_kernels(chooseRowKernels(options.baselineSimd)),
      m_scratch(workers.threads())
{
}

Aabb RowGrid::grown(const Aabb& box, float grow)
{
    Aabb result;
    for (int axis = 0; axis < 3; ++axis)
    {
        result.min[axis] = box.min[axis] - grow;
        result.max[axis] = box.max[axis] + grow;
    }
    return result;
}

std::int64_t RowGrid::cellCountOf(const CellRange& cells)
{
    return (static_cast<std::int64_t>(cells.j1) - cells.j0 + 1) *
           (static_cast<std::int64_t>(cells.k1) - cells.k0 + 1);
}

RowGrid::BoxKind RowGrid::kindOf(const Aabb& box, float grow)
{
    constexpr float kLimit = static_cast<float>(std::uint64_t{1} << kHighestOctave);
    const Float4 minima = loadFloat4(box.min);
    const Float4 maxima = loadFloat4(box.min + 2);
    const Float4 extent =
        __builtin_shuffle(maxima, Int4{1, 2, 3, 3}) - __builtin_shuffle(minima, Int4{0, 1, 2, 2});
    // NaN, the extent of a box with a NaN and of one that lies at infinity, fails both comparisons.
    if (isTrueInAll((extent >= 0.0f) & (extent <= kLimit - 4.0f * grow)))
        return BoxKind::Bounded;
    return isValid(box) ? BoxKind::Unbounded : BoxKind::Empty;
}

std::size_t RowGrid::octaveIndex(const Aabb& box) const
{
    const float y = box.max[m_plan.tileAxisY] - box.min[m_plan.tileAxisY];
    const float z = box.max[m_plan.tileAxisZ] - box.min[m_plan.tileAxisZ];
    const std::int32_t octave = std::min(std::max(octaveOf(std::max(y, z)), kLowestOctave), kHighestOctave);
    return static_cast<std::size_t>(octave - kLowestOctave);
}

RowGrid::CellRange RowGrid::cellsOf(const Aabb& box, const CellRule& rule) const
{
    const Float4 faces = {box.min[m_plan.tileAxisY], box.max[m_plan.tileAxisY], box.min[m_plan.tileAxisZ],
                          box.max[m_plan.tileAxisZ]};
    const Int4 cells = cellsOfFaces(faces, rule);
    return {cells[0], cells[1], cells[2], cells[3]};
}

void RowGrid::preparePlan(const GridInput& input)
{
    if (m_hasPlan)
        return;
    SizeHistogram sizes;
    const std::uint32_t stride = std::max(1u, input.count / 1024);
    for (std::uint32_t i = 0; i < input.count; i += stride)
    {
        const Aabb& box = input.boxes[input.ids != nullptr ? input.ids[i] : i];
        if (kindOf(box, input.grow) != BoxKind::Bounded)
            continue;
        const float y = box.max[1] - box.min[1];
        const float z = box.max[2] - box.min[2];
        const std::int32_t octave = std::max(octaveOf(std::max(y, z)), kLowestOctave) - kLowestOctave;
        SizeHistogram::Bin& bin = sizes.bins[static_cast<std::size_t>(octave)];
        bin.count += stride;
        bin.tileSum += 0.5 * stride * (static_cast<double>(y) + z);
        bin.sweepSum += static_cast<double>(stride) * (box.max[0] - box.min[0]);
    }
    makePlan(input, sizes);
}

void RowGrid::makePlan(const GridInput& input, const SizeHistogram& sizes)
{
    float span[3];
    measureSpans(input.boxes, input.ids, input.count, span);
    const int axis = chooseSweepAxis(span, m_hasPlan ? m_plan.sweepAxis : 0);
    m_plan = makeGridPlan(sizes, span, axis, m_density, {m_options.cellScale, m_options.levels});
    m_planned = sizes;
    m_hasPlan = true;
}

bool RowGrid::isPlanStale(const SizeHistogram& sizes) const
{
    const std::uint32_t total = sizes.count();
    std::uint32_t moved = 0;
    for (std::size_t o = 0; o < sizes.bins.size(); ++o)
    {
        const std::uint32_t now = sizes.bins[o].count;
        const std::uint32_t then = m_planned.bins[o].count;
        moved += now > then ? now - then : then - now;
        // A size that the plan has not seen at all may be far larger than its rows.
        if (now != 0 && then == 0 && static_cast<std::int32_t>(o) > 0 && now > total / 64)
            return true;
    }
    return moved > total / 4 + 8;
}

void RowGrid::learnDensity()
{
    const double entries = static_cast<double>(m_entryCount);
    const double lanes = static_cast<double>(m_testCount) - 6 * entries;
    const double measured = std::max(lanes, entries);
    const double predicted = std::max(m_plan.predictedCandidates, entries);
    const double ratio = measured / predicted;
    if (ratio > 0.4 && ratio < 2.5)
        return;
    m_density = std::min(std::max(m_density * ratio, 1e-3), 1e6);
    m_planned = SizeHistogram();
    // Not in every update, should the prediction stay wrong.
    if (m_followedScans >= kShortestFollow)
        m_isFollowable = false;
}

void RowGrid::recordSize(const Aabb& box, std::size_t octave, Task& task) const
{
    const float y = box.max[m_plan.tileAxisY] - box.min[m_plan.tileAxisY];
    const float z = box.max[m_plan.tileAxisZ] - box.min[m_plan.tileAxisZ];
    SizeHistogram::Bin& bin = task.sizes.bins[octave];
    bin.count += kSizeSampling;
    bin.tileSum += 0.5f * kSizeSampling * (y + z);
    bin.sweepSum += kSizeSampling * (box.max[m_plan.sweepAxis] - box.min[m_plan.sweepAxis]);
}

bool RowGrid::insertBold(std::uint32_t id, const CellRange& cells, std::int32_t level, Task& task)
{
    std::uint32_t* counts = task.boldCount.data();
    for (std::int32_t j = cells.j0; j <= cells.j1; ++j)
    {
        for (std::int32_t k = cells.k0; k <= cells.k1; ++k)
        {
            const std::uint32_t row = m_rows.findOrInsert(packCell(level, j, k));
            if (row == RowDirectory::kNone)
                return false;
            ++counts[row];
            task.bold.push({row, flagged(id, j == cells.j0, k == cells.k0)});
        }
    }
    return true;
}

/// Cells of the boxes from `begin` on, at most a block of them, into `block`; the others on the side list.
///
/// Apart from the insertion, whose branches are hard to predict, this runs at full speed.
std::uint32_t RowGrid::locate(const GridInput& input, std::uint32_t begin, std::uint32_t end, Task& task,
                              Located* block) const
{
    std::uint32_t count = 0;
    for (std::uint32_t i = begin; i < end; ++i)
    {
        const std::uint32_t id = input.ids != nullptr ? input.ids[i] : i;
        const BoxKind kind = kindOf(input.boxes[id], input.grow);
        if (kind != BoxKind::Bounded)
        {
            if (kind == BoxKind::Unbounded)
                task.unbounded.push_back(id);
            continue;
        }
        const Aabb box = grown(input.boxes[id], input.grow);
        const std::size_t octave = octaveIndex(box);
        const std::uint32_t level = m_plan.levelOfOctave[octave];
        block[count] = {cellsOf(box, ruleOf(input.reach, level)), id, static_cast<std::int32_t>(level)};
        const bool isTooLarge = cellCountOf(block[count].cells) > kMostCells;
        if (i % kSizeSampling == 0 || isTooLarge)
            recordSize(box, octave, task);
        if (isTooLarge)
            task.unbounded.push_back(id);
        else
            ++count;
    }
    return count;
}

void RowGrid::fillBold(const GridInput& input, std::uint32_t begin, std::uint32_t end, Task& task)
{
    Located block[kLocateBlock];
    for (std::uint32_t i = begin; i < end; i += kLocateBlock)
    {
        const std::uint32_t count = locate(input, i, std::min(end, i + kLocateBlock), task, block);
        task.bold.makeRoom(static_cast<std::size_t>(count) * kMostCells);
        for (std::uint32_t k = 0; k < count; ++k)
        {
            if (insertBold(block[k].id, block[k].cells, block[k].level, task))
                continue;
            task.isFull = true;
            return;
        }
    }
}

void RowGrid::fillRegular(const GridInput& input, std::uint32_t begin, std::uint32_t end, Task& task)
{
    for (std::uint32_t i = begin; i < end; ++i)
    {
        const std::uint32_t id = input.ids != nullptr ? input.ids[i] : i;
        if (kindOf(input.boxes[id], input.grow) != BoxKind::Bounded)
            continue;
        const Aabb box = grown(input.boxes[id], input.grow);
        const std::uint32_t own = m_plan.levelOfOctave[octaveIndex(box)];
        if (cellCountOf(cellsOf(box, ruleOf(input.reach, own))) > kMostCells)
            continue;
        for (std::uint32_t level = own + 1; level < m_plan.levelCount; ++level)
        {
            const CellRange cells = cellsOf(box, ruleOf(input.reach, level));
            task.regular.makeRoom(static_cast<std::size_t>(cellCountOf(cells)));
            for (std::int32_t j = cells.j0; j <= cells.j1; ++j)
            {
                for (std::int32_t k = cells.k0; k <= cells.k1; ++k)
                {
                    const std::uint32_t row = m_rows.find(packCell(static_cast<std::int32_t>(level), j, k));
                    if (row == RowDirectory::kNone)
                        continue;
                    ++task.regularCount[row];
                    task.regular.push({row, flagged(id, j == cells.j0, k == cells.k0)});
                }
            }
        }
    }
}

bool RowGrid::tryFill(const GridInput& input)
{
    m_rows.reset(m_rowRoom, m_options.bucketCount);
    for (unsigned t = 0; t < m_taskCount; ++t)
    {
        Task& task = m_tasks[t];
        task.bold.clear();
        task.regular.clear();
        task.unbounded.clear();
        task.boldCount.assign(m_rowRoom, 0);
        task.regularCount.assign(m_plan.levelCount > 1 ? m_rowRoom : 0, 0);
        task.sizes = SizeHistogram();
        task.isFull = false;
    }
    m_workers.run(m_taskCount,
                  [&](unsigned t)
                  {
                      const TaskRange range(input.count, t, m_taskCount);
                      fillBold(input, range.begin, range.end, m_tasks[t]);
                  });
    for (unsigned t = 0; t < m_taskCount; ++t)
    {
        if (m_tasks[t].isFull)
            return false;
    }
    if (m_plan.levelCount > 1)
    {
        m_workers.run(m_taskCount,
                      [&](unsigned t)
                      {
                          const TaskRange range(input.count, t, m_taskCount);
                          fillRegular(input, range.begin, range.end, m_tasks[t]);
                      });
    }
    return true;
}

void RowGrid::fill(const GridInput& input)
{
    m_taskCount = m_workers.tasksFor(input.count, kTaskGrain);
    if (m_tasks.size() < m_taskCount)
        m_tasks.resize(m_taskCount);
    preparePlan(input);
    for (int attempt = 0;; ++attempt)
    {
        while (!tryFill(input))
            m_rowRoom *= 2;
        SizeHistogram sizes;
        for (unsigned t = 0; t < m_taskCount; ++t)
            sizes.add(m_tasks[t].sizes);
        if (attempt > 0 || !isPlanStale(sizes))
            break;
        makePlan(input, sizes);
    }
    // Room for twice the rows in use, so that the next frames need no second attempt.
    const std::uint32_t used = m_rows.capacity();
    if (m_rowRoom > 8 * used + 1024)
        m_rowRoom /= 2;
}

/// Turns per-task counts into lists and moves the ids of every row together; the number of entries.
std::uint32_t RowGrid::scatterKind(EntryList Task::*entries, std::vector<std::uint32_t> Task::*counts,
                                   std::vector<RowList>& lists, std::vector<FlaggedId>& ids, bool slack)
{
    const std::uint32_t rows = m_rows.capacity();
    lists.resize(rows);
    std::uint32_t begin = 0;
    std::uint32_t sum = 0;
    for (std::uint32_t row = 0; row < rows; ++row)
    {
        std::uint32_t next = begin;
        for (unsigned t = 0; t < m_taskCount; ++t)
        {
            std::uint32_t& slot = (m_tasks[t].*counts)[row];
            const std::uint32_t size = slot;
            slot = next;
            next += size;
        }
        const std::uint32_t count = next - begin;
        const std::uint32_t room = (count + (slack && count != 0 ? count / 8 + 4 : 0) + 3) & ~3u;
        lists[row] = {begin, count, room, count};
        begin += room;
        sum += count;
    }
    m_idsUsed = begin;
    if (ids.size() < begin + kRowPadding)
        ids.resize(begin + begin / 4 + kRowPadding);
    m_workers.run(m_taskCount,
                  [&](unsigned t)
                  {
                      std::vector<std::uint32_t>& next = m_tasks[t].*counts;
                      for (const Entry& entry : m_tasks[t].*entries)
                          ids[next[entry.row]++] = entry.id;
                  });
    return sum;
}

void RowGrid::mergeTasks(RowUse use)
{
    m_regular.clear();
    m_entryCount = 0;
    if (m_plan.levelCount > 1)
        m_entryCount = scatterKind(&Task::regular, &Task::regularCount, m_regular, m_regularIds, false);
    m_entryCount += scatterKind(&Task::bold, &Task::boldCount, m_bold, m_boldIds, use == RowUse::Follow);
    m_unbounded.clear();
    for (unsigned t = 0; t < m_taskCount; ++t)
        m_unbounded.insert(m_unbounded.end(), m_tasks[t].unbounded.begin(), m_tasks[t].unbounded.end());
    std::sort(m_unbounded.begin(), m_unbounded.end());
}

RowSoa RowGrid::buildRow(const RowPass& pass, std::uint32_t row, RowList& list, std::vector<FlaggedId>& ids,
                         RowPool& pool, std::size_t offset, RowBuilder& builder)
{
    FlaggedId* const own = ids.data() + list.begin;
    if (!pass.isSorted)
        builder.sort(own, list.count, pass.input.boxes, m_plan.sweepAxis);
    const RowSource source = {own,
                              list.count,
                              list.sortedCount,
                              pass.input.boxes,
                              m_plan.sweepAxis,
                              pass.input.grow,
                              pass.isFollowed ? &edgesOf(row) : nullptr};
    RowSoa soa = pool.row(offset, own, list.count);
    builder.build(m_kernels, source, soa);
    list.count = soa.count;
    list.sortedCount = soa.count;
    return soa;
}

void RowGrid::scanRow(const RowPass& pass, std::uint32_t row, unsigned worker, PairBuffer& out)
{
    RowList& own = m_bold[row];
    const std::uint32_t regularCount = m_regular.empty() ? 0 : m_regular[row].count;
    if (own.count == 0 || (own.count + regularCount == 1 && pass.use == RowUse::Once))
        return;
    Worker& scratch = m_scratch[worker];
    const bool isKept = pass.use == RowUse::Query;
    if (!isKept)
        scratch.bold.resize(own.count + 4u);
    const RowSoa bold = buildRow(pass, row, own, m_boldIds, isKept ? m_kept : scratch.bold,
                                 isKept ? keptOffset(row) : 0, scratch.builder);
    if (isKept)
        m_longest[row] = longestOf(bold);
    m_kernels.scanSelf(bold, out);
    if (regularCount == 0)
        return;
    scratch.regular.resize(regularCount + 4u);
    const RowSoa regular =
        buildRow(pass, row, m_regular[row], m_regularIds, scratch.regular, 0, scratch.builder);
    m_kernels.scanCross(bold, regular, out);
}

void RowGrid::scanRows(const RowPass& pass)
{
    const std::uint32_t rows = m_rows.capacity();
    if (pass.use == RowUse::Query)
    {
        m_kept.resize(m_idsUsed + std::size_t{4} * rows);
        m_longest.assign(rows, 0.0f);
    }
    for (Worker& worker : m_scratch)
        worker.buffer->tests = 0;
    const unsigned tasks = m_taskCount == 1 ? 1u : std::max(1u, rows / kRowsPerTask);
    m_workers.run(tasks,
                  [&](unsigned task)
                  {
                      const unsigned worker =
                          tasks == 1 ? 0u
                                     : static_cast<unsigned>(tbb::this_task_arena::current_thread_index());
                      SinkContext context = {&pass.sink, worker};
                      PairBuffer& out = prepareBuffer(worker, pass.input, &context);
                      const TaskRange range(rows, task, tasks);
                      for (std::uint32_t row = range.begin; row < range.end; ++row)
                          scanRow(pass, row, worker, out);
                      out.handOn();
                  });
    m_testCount = 0;
    for (const Worker& worker : m_scratch)
        m_testCount += worker.buffer->tests;
    scanUnbounded(pass.input, pass.sink);
}

PairBuffer& RowGrid::prepareBuffer(unsigned worker, const GridInput& input, void* context) const
{
    PairBuffer& out = *m_scratch[worker].buffer;
    out.flush = handToSink;
    out.context = context;
    out.near = input.near;
    out.deep = input.deep;
    return out;
}

void RowGrid::scanUnbounded(const GridInput& input, PairSink& sink)
{
    SinkContext context = {&sink, 0};
    PairBuffer& out = prepareBuffer(0, input, &context);
    for (const std::uint32_t large : m_unbounded)
    {
        const Aabb box = grown(input.boxes[large], input.grow);
        for (std::uint32_t i = 0; i < input.count; ++i)
        {
            const std::uint32_t id = input.ids != nullptr ? input.ids[i] : i;
            const float gap = gapOf(box, grown(input.boxes[id], input.grow));
            if (!isValid(input.boxes[id]) || gap > input.near || gap <= input.deep)
                continue;
            // Of two unbounded boxes, the one with the lower id reports the pair.
            if (id <= large && std::binary_search(m_unbounded.begin(), m_unbounded.end(), id))
                continue;
            out.ensureRoom();
            out.first[out.count] = large;
            out.second[out.count] = id;
            out.gap[out.count++] = gap;
        }
    }
    out.handOn();
}

void RowGrid::scan(const GridInput& input, PairSink& sink, RowUse use)
{
    m_isFollowable = false;
    fill(input);
    mergeTasks(use);
    scanRows({input, sink, use, false, false});
    m_isFollowable = use == RowUse::Follow && m_plan.levelCount == 1;
    m_reach = input.reach;
    m_followedScans = 0;
    if (m_options.cellScale <= 0)
        learnDensity();
}

void RowGrid::queryRow(const RowSoa& query, std::uint32_t row, PairBuffer& out) const
{
    const std::uint32_t count = m_bold[row].count;
    const RowSoa kept = m_kept.row(keptOffset(row), m_boldIds.data() + m_bold[row].begin, count);
    // No kept interval is longer than m_longest, so none that begins before `from` reaches the query; rounded down.
    float from = query.x0[0] - m_longest[row];
    from -= std::abs(from) * 1e-6f;
    const std::uint32_t begin =
        static_cast<std::uint32_t>(std::lower_bound(kept.x0, kept.x0 + count, from) - kept.x0);
    if (count != 0)
        m_kernels.scanOne(query, 0, kept, begin, out);
}

void RowGrid::queryLevel(const RowSoa& query, const Aabb& box, std::uint32_t level, PairBuffer& out) const
{
    const CellRange cells = cellsOf(box, ruleOf(0.0f, level));
    const std::uint32_t id = query.id[0] & kIdMask;
    const auto visit = [&](std::uint32_t row, std::int32_t j, std::int32_t k)
    {
        query.id[0] = flagged(id, j == cells.j0, k == cells.k0);
        queryRow(query, row, out);
    };
    if (cellCountOf(cells) > m_rows.count())
    {
        for (std::uint32_t row = 0; row < m_rows.capacity(); ++row)
        {
            const std::uint64_t cell = m_rows.cell(row);
            const std::int32_t j = cellCoordinateJ(cell);
            const std::int32_t k = cellCoordinateK(cell);
            if (levelOfCell(cell) == static_cast<std::int32_t>(level) && cells.contains(j, k))
                visit(row, j, k);
        }
        return;
    }
    for (std::int32_t j = cells.j0; j <= cells.j1; ++j)
    {
        for (std::int32_t k = cells.k0; k <= cells.k1; ++k)
        {
            const std::uint32_t row = m_rows.find(packCell(static_cast<std::int32_t>(level), j, k));
            if (row != RowDirectory::kNone)
                visit(row, j, k);
        }
    }
}

void RowGrid::query(const Aabb& box, FlaggedId id, unsigned worker, PairSink& sink) const
{
    // Finite, or the sentinel at the end of a row would count as inside.
    float x0 = box.min[m_plan.sweepAxis];
    float x1 = std::min(box.max[m_plan.sweepAxis], std::numeric_limits<float>::max());
    float y0 = box.min[m_plan.tileAxisY], y1 = box.max[m_plan.tileAxisY];
    float z0 = box.min[m_plan.tileAxisZ], z1 = box.max[m_plan.tileAxisZ];
    const RowSoa soa = {&x0, &x1, &y0, &y1, &z0, &z1, &id, 1};
    SinkContext context = {&sink, worker};
    PairBuffer& out = prepareBuffer(worker, GridInput{}, &context);
    for (std::uint32_t level = 0; level < m_plan.levelCount; ++level)
        queryLevel(soa, box, level, out);
    out.handOn();
}

void RowGrid::forEachCell(const CellVisitor& visit) const
{
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (std::uint32_t row = 0; row < m_rows.capacity(); ++row)
    {
        const std::uint64_t cell = m_rows.cell(row);
        if (cell == 0)
            continue;
        const std::int32_t level = levelOfCell(cell);
        const float j = static_cast<float>(cellCoordinateJ(cell)),
                    k = static_cast<float>(cellCoordinateK(cell));
        Aabb box{{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
        box.min[m_plan.tileAxisY] = j * m_plan.width[level];
        box.max[m_plan.tileAxisY] = (j + 1) * m_plan.width[level];
        box.min[m_plan.tileAxisZ] = k * m_plan.width[level];
        box.max[m_plan.tileAxisZ] = (k + 1) * m_plan.width[level];
        visit(box, static_cast<std::uint32_t>(level));
    }
}

std::uint64_t RowGrid::bytes() const
{
    std::uint64_t sum =
        m_rows.bytes() + m_kept.bytes() + (m_bold.capacity() + m_regular.capacity()) * sizeof(RowList) +
        (m_boldIds.capacity() + m_regularIds.capacity() + m_unbounded.capacity() + m_longest.capacity()) *
            sizeof(std::uint32_t);
    for (const Task& task : m_tasks)
    {
        sum += task.bold.bytes() + task.regular.bytes() +
               (task.boldCount.capacity() + task.regularCount.capacity() + task.unbounded.capacity()) *
                   sizeof(std::uint32_t);
    }
    for (const Worker& worker : m_scratch)
        sum += worker.bold.bytes() + worker.regular.bytes() + worker.builder.bytes() + sizeof(PairBuffer);
    return sum;
}
}  // namespace cullet
