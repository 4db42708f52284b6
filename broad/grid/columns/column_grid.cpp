// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/columns/column_grid.h"

#include "cullet/broad/boxes/aabb_simd.h"

#include <algorithm>
#include <utility>

namespace cullet
{
namespace
{
constexpr std::uint32_t kRowsPerTask = 4;
}

ColumnGrid::ColumnGrid(const GridOptions& options, ParallelLoops& workers)
    : m_options(options),
      m_workers(workers),
      m_kernels(chooseRowKernels(options.baselineSimd)),
      m_scratch(workers.threads())
{
}

Aabb ColumnGrid::grown(const Aabb& box, float grow)
{
    Aabb result;
    for (int axis = 0; axis < 3; ++axis)
    {
        result.min[axis] = box.min[axis] - grow;
        result.max[axis] = box.max[axis] + grow;
    }
    return result;
}

void ColumnGrid::handToSink(void* context, const PairBuffer& found)
{
    const SinkContext& to = *static_cast<SinkContext*>(context);
    to.sink->take(to.worker, found);
}

ColumnSoa ColumnGrid::buildRow(const RowPass& pass, std::uint32_t row, RowList& list,
                               std::vector<FlaggedId>& ids, RowPool& pool, std::size_t offset,
                               ColumnBuilder& builder)
{
    FlaggedId* const own = ids.data() + list.begin;
    const RowSource source = {own,
                              list.count,
                              list.sortedCount,
                              pass.input.boxes,
                              m_plan.sweepAxis,
                              m_sweepLow,
                              m_sweepHigh,
                              pass.input.grow,
                              pass.isFollowed ? &edgesOf(row) : nullptr};
    ColumnSoa soa = pool.row(offset, own, list.count, pass.input.motions != nullptr);
    builder.build(m_kernels, source, soa);
    for (std::uint32_t i = 0; soa.bounds != nullptr && i < soa.count; ++i)
        soa.bounds[i] = pass.input.motionFactor * pass.input.motions[soa.id[i] & kIdMask];
    list.count = soa.count;
    list.sortedCount = soa.count;
    return soa;
}

void ColumnGrid::scanRow(const RowPass& pass, std::uint32_t row, unsigned worker, PairBuffer& out)
{
    RowList& own = m_bold[row];
    const std::uint32_t regularCount = m_regular.empty() ? 0 : m_regular[row].count;
    if (own.count == 0 || (own.count + regularCount == 1 && pass.use == RowUse::Once))
        return;
    Worker& scratch = m_scratch[worker];
    const bool isKept = pass.use == RowUse::Query;
    if (!isKept)
        scratch.bold.resize(own.count + 4u);
    const ColumnSoa bold = buildRow(pass, row, own, m_boldIds, isKept ? m_kept : scratch.bold,
                                    isKept ? own.begin : 0, scratch.builder);
    if (isKept)
        m_longest[row] = longestOf(bold);
    m_kernels.scanSelf(bold, out);
    if (regularCount == 0)
        return;
    scratch.regular.resize(regularCount + 4u);
    const ColumnSoa regular =
        buildRow(pass, row, m_regular[row], m_regularIds, scratch.regular, 0, scratch.builder);
    m_kernels.scanCross(bold, regular, out);
}

void ColumnGrid::scanRows(const RowPass& pass)
{
    const std::uint32_t rows = m_rows.capacity();
    if (pass.use == RowUse::Query)
    {
        m_kept.resize(m_idsUsed);
        m_longest.assign(rows, 0.0f);
    }
    for (Worker& worker : m_scratch)
        worker.buffer->tests = 0;
    const unsigned tasks = m_taskCount == 1 ? 1u : std::max(1u, rows / kRowsPerTask);
    m_workers.run(tasks,
                  [&](unsigned task, unsigned worker)
                  {
                      SinkContext context = {&pass.sink, worker};
                      PairBuffer& out = prepareBuffer(pass.input, context);
                      const TaskRange range(rows, task, tasks);
                      for (std::uint32_t row = range.begin; row < range.end; ++row)
                          scanRow(pass, row, worker, out);
                      out.handOn();
                  });
    m_testCount = 0;
    for (const Worker& worker : m_scratch)
        m_testCount += std::exchange(worker.buffer->tests, 0);
    scanUnbounded(pass.input, pass.sink);
}

PairBuffer& ColumnGrid::prepareBuffer(const GridInput& input, SinkContext& context) const
{
    PairBuffer& out = *m_scratch[context.worker].buffer;
    out.count = 0;  // a failed scan leaves pairs in the buffer
    out.flush = handToSink;
    out.context = &context;
    out.near = input.near;
    out.deep = input.deep;
    return out;
}

void ColumnGrid::scanUnbounded(const GridInput& input, PairSink& sink)
{
    SinkContext context = {&sink, 0};
    PairBuffer& out = prepareBuffer(input, context);
    for (const std::uint32_t large : m_unbounded)
    {
        const Aabb box = grown(input.boxes[large], input.grow);
        for (std::uint32_t i = 0; i < input.count; ++i)
        {
            const std::uint32_t id = input.ids != nullptr ? input.ids[i] : i;
            const float gap = gapOf(box, grown(input.boxes[id], input.grow));
            if (!isValid(input.boxes[id]) || gap > input.near || gap <= input.deep)
                continue;
            // Of two unbounded boxes, the one with the lower index in the ProxyTable reports the pair.
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

void ColumnGrid::scan(const GridInput& input, PairSink& sink, RowUse use)
{
    m_isFollowable = false;
    fill(input);
    mergeTasks(use);
    scanRows({input, sink, use, false});
    m_isFollowable = use == RowUse::Follow && m_plan.levelCount == 1;
    m_reach = input.reach;
    m_followedScans = 0;
    if (m_options.cellScale <= 0)
        learnDensity();
}

std::uint64_t ColumnGrid::bytes() const
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
