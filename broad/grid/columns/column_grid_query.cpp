// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Queries for single boxes in the columns of the last scan.
#include "cullet/broad/grid/columns/column_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

namespace cullet
{
namespace
{
/// Index of the first of some ascending values that is not below `from`. It has no branches, as they would be
/// mispredicted.
std::uint32_t lowerBound(const float* values, std::uint32_t count, float from)
{
    std::uint32_t begin = 0;
    while (count > 1)
    {
        const std::uint32_t half = count / 2;
        begin += values[begin + half - 1] < from ? half : 0u;
        count -= half;
    }
    return begin + (count != 0 && values[begin] < from ? 1u : 0u);
}
}  // namespace

void ColumnGrid::queryColumn(const ColumnSoa& query, std::uint32_t column, PairBuffer& out) const
{
    const std::uint32_t count = m_bold[column].count;
    const std::uint32_t offset = m_bold[column].begin;
    const ColumnSoa kept = m_kept.column(offset, m_boldRows.data() + offset, count);
    // No kept interval is longer than m_longestExtents, so none that begins before `from` reaches the query. The
    // difference is rounded down.
    float from = query.x0[0] - m_longestExtents[column];
    from -= std::abs(from) * 1e-6f;
    const std::uint32_t begin = lowerBound(kept.x0, count, from);
    ++out.visits;
    if (count != 0)
        m_kernels.scanOne(query, 0, kept, begin, out);
}

void ColumnGrid::queryLevel(const ColumnSoa& query, const Aabb& box, std::uint32_t level,
                            PairBuffer& out) const
{
    const CellRect cells = cellsOf(box, cellBoundsOf(0.0f, level));
    const std::uint32_t proxyRow = query.proxyRow[0] & kRowMask;
    const auto visit = [&](std::uint32_t column, std::int32_t j, std::int32_t k)
    {
        query.proxyRow[0] = tagRow(proxyRow, j == cells.j0, k == cells.k0);
        queryColumn(query, column, out);
    };
    if (cellCountOf(cells) > m_columns.count())
    {
        for (std::uint32_t column = 0; column < m_columns.capacity(); ++column)
        {
            const std::uint64_t cell = m_columns.cell(column);
            const std::int32_t j = cellCoordinateJ(cell);
            const std::int32_t k = cellCoordinateK(cell);
            if (levelOfCell(cell) == static_cast<std::int32_t>(level) && cells.contains(j, k))
                visit(column, j, k);
        }
        return;
    }
    for (std::int32_t j = cells.j0; j <= cells.j1; ++j)
    {
        for (std::int32_t k = cells.k0; k <= cells.k1; ++k)
        {
            const std::uint32_t column = m_columns.find(packCell(static_cast<std::int32_t>(level), j, k));
            if (column != ColumnHash::kNone)
                visit(column, j, k);
        }
    }
}

void ColumnGrid::queryBox(const Aabb& box, TaggedRow proxyRow, PairBuffer& out) const
{
    // The end is finite, since the sentinel at the end of a column would count as inside otherwise.
    float x0 = box.min[plan().sweepAxis];
    float x1 = std::min(box.max[plan().sweepAxis], std::numeric_limits<float>::max());
    float y0 = box.min[plan().tileAxisY], y1 = box.max[plan().tileAxisY];
    float z0 = box.min[plan().tileAxisZ], z1 = box.max[plan().tileAxisZ];
    const ColumnSoa soa = {&x0, &x1, &y0, &y1, &z0, &z1, &proxyRow, 1};
    for (std::uint32_t level = 0; level < plan().levelCount; ++level)
        queryLevel(soa, box, level, out);
}

ColumnGrid::Work ColumnGrid::collectWork()
{
    Work work;
    work.tests = std::exchange(m_testCount, 0);
    for (const Worker& worker : m_scratch)
    {
        work.tests += std::exchange(worker.buffer->tests, 0);
        work.visits += std::exchange(worker.buffer->visits, 0);
    }
    return work;
}

void ColumnGrid::query(const Aabb* boxes, std::uint32_t count, unsigned worker, PairSink& sink) const
{
    SinkContext context = {&sink, worker};
    PairBuffer& out = prepareBuffer(GridInput{}, context);
    for (std::uint32_t i = 0; i < count; ++i)
    {
        if (isValid(boxes[i]))
            queryBox(boxes[i], i, out);
    }
    out.deliver();
}

std::vector<std::uint32_t> ColumnGrid::orderAlongColumns(const Aabb* boxes,
                                                         const std::vector<std::uint32_t>& proxyRows) const
{
    std::vector<std::tuple<std::uint64_t, float, std::uint32_t>> places;
    places.reserve(proxyRows.size());
    for (std::uint32_t i = 0; i < proxyRows.size(); ++i)
    {
        const Aabb& box = boxes[proxyRows[i]];
        const bool isBounded = kindOf(box, 0) == BoxKind::Bounded;
        const CellRect cells = isBounded ? cellsOf(box, cellBoundsOf(0.0f, 0)) : CellRect{};
        places.emplace_back(packCell(0, cells.j0, cells.k0), isBounded ? box.min[plan().sweepAxis] : 0.0f, i);
    }
    std::sort(places.begin(), places.end());
    std::vector<std::uint32_t> order(places.size());
    std::transform(places.begin(), places.end(), order.begin(),
                   [](const auto& place) { return std::get<2>(place); });
    return order;
}

void ColumnGrid::forEachCell(const CellVisitor& visit) const
{
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (std::uint32_t column = 0; column < m_columns.capacity(); ++column)
    {
        const std::uint64_t cell = m_columns.cell(column);
        if (cell == 0 || m_bold[column].count == 0)
            continue;
        const std::int32_t level = levelOfCell(cell);
        const float j = static_cast<float>(cellCoordinateJ(cell)),
                    k = static_cast<float>(cellCoordinateK(cell));
        Aabb box{{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
        box.min[plan().tileAxisY] = j * plan().width[level];
        box.max[plan().tileAxisY] = (j + 1) * plan().width[level];
        box.min[plan().tileAxisZ] = k * plan().width[level];
        box.max[plan().tileAxisZ] = (k + 1) * plan().width[level];
        visit(box, static_cast<std::uint32_t>(level));
    }
}
}  // namespace cullet
