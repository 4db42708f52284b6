// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/columns/column_grid.h"

#include "cullet/base/bytes_of.h"
#include "cullet/broad/boxes/aabb_simd.h"

#include <algorithm>
#include <utility>

namespace cullet
{
namespace
{
constexpr std::uint32_t kColumnsPerTask = 4;
}

ColumnGrid::ColumnGrid(const GridOptions& options, ParallelLoops& workers)
    : m_bucketCount(options.bucketCount),
      m_workers(workers),
      m_kernels(chooseColumnKernels(options.baselineSimd)),
      m_planner(options),
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

void ColumnGrid::deliverToSink(void* context, const PairBuffer& found)
{
    const SinkContext& to = *static_cast<SinkContext*>(context);
    to.sink->take(to.worker, found);
}

ColumnSoa ColumnGrid::buildColumn(const ColumnPass& pass, std::uint32_t column, ColumnList& list,
                                  std::vector<TaggedRow>& proxyRows, ColumnPool& pool, std::size_t offset,
                                  ColumnBuilder& builder)
{
    TaggedRow* const own = proxyRows.data() + list.begin;
    const ColumnSource source = {own,
                                 list.count,
                                 list.sortedCount,
                                 pass.input.boxes,
                                 plan().sweepAxis,
                                 m_sweepLow,
                                 m_sweepHigh,
                                 pass.input.grow,
                                 pass.isFollowed ? &edgesOf(column) : nullptr};
    ColumnSoa soa = pool.column(offset, own, list.count, pass.input.motions != nullptr);
    builder.build(m_kernels, source, soa);
    for (std::uint32_t i = 0; soa.bounds != nullptr && i < soa.count; ++i)
        soa.bounds[i] = pass.input.motionFactor * pass.input.motions[soa.proxyRow[i] & kRowMask];
    list.count = soa.count;
    list.sortedCount = soa.count;
    return soa;
}

void ColumnGrid::scanColumn(const ColumnPass& pass, std::uint32_t column, unsigned worker, PairBuffer& out)
{
    ColumnList& own = m_bold[column];
    const std::uint32_t regularCount = m_regular.empty() ? 0 : m_regular[column].count;
    if (own.count == 0 || (own.count + regularCount == 1 && pass.use == ColumnUse::Once))
        return;
    Worker& scratch = m_scratch[worker];
    const bool isKept = pass.use == ColumnUse::Query;
    if (!isKept)
        scratch.bold.resize(own.count + 4u);
    const ColumnSoa bold = buildColumn(pass, column, own, m_boldRows, isKept ? m_kept : scratch.bold,
                                       isKept ? own.begin : 0, scratch.builder);
    if (pass.use != ColumnUse::Once)
        m_longestExtents[column] = longestSweepExtent(bold);
    m_kernels.scanSelf(bold, out);
    if (regularCount == 0)
        return;
    scratch.regular.resize(regularCount + 4u);
    const ColumnSoa regular =
        buildColumn(pass, column, m_regular[column], m_regularRows, scratch.regular, 0, scratch.builder);
    m_kernels.scanCross(bold, regular, out);
}

void ColumnGrid::scanColumns(const ColumnPass& pass)
{
    const std::uint32_t columns = m_columns.capacity();
    m_use = pass.use;
    if (pass.use == ColumnUse::Query)
        m_kept.resize(m_boldRowsUsed);
    if (pass.use != ColumnUse::Once)
        m_longestExtents.assign(columns, 0.0f);
    for (Worker& worker : m_scratch)
        worker.buffer->tests = 0;
    const unsigned tasks = m_taskCount == 1 ? 1u : std::max(1u, columns / kColumnsPerTask);
    m_workers.run(tasks,
                  [&](unsigned task, unsigned worker)
                  {
                      SinkContext context = {&pass.sink, worker};
                      PairBuffer& out = prepareBuffer(pass.input, context);
                      const TaskRange range(columns, task, tasks);
                      for (std::uint32_t column = range.begin; column < range.end; ++column)
                          scanColumn(pass, column, worker, out);
                      out.deliver();
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
    out.flush = deliverToSink;
    out.context = &context;
    out.maxGap = input.maxGap;
    out.minGap = input.minGap;
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
            const std::uint32_t proxyRow = input.proxyRows != nullptr ? input.proxyRows[i] : i;
            const float gap = gapOf(box, grown(input.boxes[proxyRow], input.grow));
            if (!isValid(input.boxes[proxyRow]) || gap > input.maxGap || gap <= input.minGap)
                continue;
            // Of two unbounded boxes, the one with the lower index in the ProxyTable reports the pair.
            if (proxyRow <= large && std::binary_search(m_unbounded.begin(), m_unbounded.end(), proxyRow))
                continue;
            out.ensureRoom();
            out.first[out.count] = large;
            out.second[out.count] = proxyRow;
            out.gap[out.count++] = gap;
        }
    }
    out.deliver();
}

void ColumnGrid::scan(const GridInput& input, PairSink& sink, ColumnUse use)
{
    m_isFollowable = false;
    fill(input);
    mergeTasks(use);
    scanColumns({input, sink, use, false});
    m_isFollowable = use == ColumnUse::Follow && plan().levelCount == 1;
    m_cellSkin = input.cellSkin;
    m_followedScans = 0;
    m_planner.learnDensity(m_entryCount, m_testCount);
}

std::uint64_t ColumnGrid::bytes() const
{
    std::uint64_t sum = m_columns.bytes() + m_kept.bytes() +
                        bytesOf(m_tasks, m_scratch, m_bold, m_regular, m_boldRows, m_regularRows, m_unbounded,
                                m_longestExtents, m_edges, m_hasEdges, m_motions);
    for (const Task& task : m_tasks)
        sum += task.bold.bytes() + task.regular.bytes() +
               bytesOf(task.boldCount, task.regularCount, task.unbounded);
    for (const Worker& worker : m_scratch)
        sum += worker.bold.bytes() + worker.regular.bytes() + worker.builder.bytes() + sizeof(PairBuffer);
    for (const GridMotion& motion : m_motions)
        sum += bytesOf(motion.migrated);
    return sum;
}
}  // namespace cullet
