// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Rows near a ray or a box, from the columns of the last scan.
#include "cullet/broad/grid/columns/column_grid.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace cullet
{
namespace
{
/// The part of a ray that passes through an interval of one axis, in units of its direction; false if none does.
bool clipRay(const RayPath& ray, int axis, double low, double high, double& begin, double& end)
{
    begin = 0.0;
    end = ray.length;
    const double direction = ray.direction[axis];
    const double enter = low - ray.high[axis] - ray.origin[axis];
    const double leave = high - ray.low[axis] - ray.origin[axis];
    if (direction == 0.0)
        return enter <= 0.0 && leave >= 0.0;
    begin = std::max(begin, (direction > 0.0 ? enter : leave) / direction);
    end = std::min(end, (direction > 0.0 ? leave : enter) / direction);
    return begin <= end;
}
}  // namespace

/// Rows on their way to a sink.
class ColumnGrid::RowBatch
{
public:
    RowBatch(const Aabb* boxes, RowSink& sink) : m_boxes(boxes), m_sink(sink) {}
    RowBatch(const RowBatch&) = delete;
    RowBatch& operator=(const RowBatch&) = delete;
    ~RowBatch() { flush(); }

    const Aabb& boxOf(TaggedRow row) const { return m_boxes[row & kRowMask]; }

    void add(TaggedRow row)
    {
        if (m_count == m_rows.size())
            flush();
        m_rows[m_count++] = row & kRowMask;
    }

    void countColumn() { ++m_columns; }

    std::uint32_t cost() const
    {
        constexpr std::uint32_t kColumnCost = 32;  // of a search in a column, in scanned boxes
        return 1 + kColumnCost * m_columns;
    }

private:
    void flush()
    {
        if (m_count != 0)
            m_sink.take(m_rows.data(), m_count);
        m_count = 0;
    }

    const Aabb* const m_boxes;
    RowSink& m_sink;
    std::array<std::uint32_t, 64> m_rows;
    std::uint32_t m_count = 0;
    std::uint32_t m_columns = 0;
};

void ColumnGrid::findInColumn(std::uint32_t column, const Aabb& box, RowBatch& rows) const
{
    const ColumnList& list = m_bold[column];
    const TaggedRow* const own = m_boldRows.data() + list.begin;
    rows.countColumn();
    // Where the columns are kept, they have larger boxes than the table, in the order of which the rows are.
    const bool isKept = m_use == ColumnUse::Query;
    const float* const kept =
        isKept ? m_kept.column(list.begin, m_boldRows.data() + list.begin, list.count).x0 : nullptr;
    const auto beginOf = [&](std::uint32_t i)
    { return isKept ? kept[i] : rows.boxOf(own[i]).min[plan().sweepAxis]; };
    // As in queryColumn().
    float from = box.min[plan().sweepAxis] - m_longestExtents[column];
    from -= std::abs(from) * 1e-6f;
    std::uint32_t i = 0;
    for (std::uint32_t count = list.count; count > 0;)
    {
        const std::uint32_t half = count / 2;
        const bool isBelow = beginOf(i + half) < from;
        i += isBelow ? half + 1 : 0;
        count = isBelow ? count - half - 1 : half;
    }
    for (; i < list.count && beginOf(i) <= box.max[plan().sweepAxis]; ++i)
    {
        if (isValid(rows.boxOf(own[i])) && overlaps(rows.boxOf(own[i]), box))
            rows.add(own[i]);
    }
}

void ColumnGrid::findInCells(std::uint32_t level, const CellRect& cells, const Aabb& box,
                             RowBatch& rows) const
{
    for (std::int32_t j = cells.j0; j <= cells.j1; ++j)
    {
        for (std::int32_t k = cells.k0; k <= cells.k1; ++k)
        {
            const std::uint32_t column = m_columns.find(packCell(static_cast<std::int32_t>(level), j, k));
            if (column != ColumnHash::kNone && m_bold[column].count != 0)
                findInColumn(column, box, rows);
        }
    }
}

void ColumnGrid::findUnbounded(const Aabb& box, RowBatch& rows) const
{
    for (const std::uint32_t row : m_unbounded)
    {
        if (isValid(rows.boxOf(row)) && overlaps(rows.boxOf(row), box))
            rows.add(row);
    }
}

std::uint32_t ColumnGrid::findNearBox(const Aabb& box, const Aabb* boxes, RowSink& sink) const
{
    std::int64_t cells = 0;
    for (std::uint32_t level = 0; level < plan().levelCount; ++level)
        cells += cellCountOf(cellsOf(box, cellBoundsOf(0.0f, level)));
    if (m_bold.empty() || cells > kMostFindCells)
        return 0;
    RowBatch rows(boxes, sink);
    for (std::uint32_t level = 0; level < plan().levelCount; ++level)
        findInCells(level, cellsOf(box, cellBoundsOf(0.0f, level)), box, rows);
    findUnbounded(box, rows);
    return rows.cost();
}

/// Follows the ray through the cells of a level: along the tiled axis on which it goes farther, one cell after the
/// other.
void ColumnGrid::followRay(std::uint32_t level, const RayPath& ray, const CellRect& all, RowBatch& rows) const
{
    const bool isAlongY = isLongerAlongY(ray);
    const int axis = isAlongY ? plan().tileAxisY : plan().tileAxisZ;
    const double width = plan().width[level];
    const std::int32_t last = isAlongY ? all.j1 : all.k1;
    for (std::int32_t cell = isAlongY ? all.j0 : all.k0; cell <= last; ++cell)
    {
        // Boxes near the edge of a cell may be in it by the roundings of CellBounds.
        const double low = cell * width, high = low + width;
        const double slack = 1e-6 * (std::abs(low) + std::abs(high)) + 1e-5 * width;
        double begin, end;
        if (!clipRay(ray, axis, low - slack, high + slack, begin, end))
            continue;
        const Aabb box = ray.around(begin, end);
        CellRect cells = cellsOf(box, cellBoundsOf(0.0f, level));
        if (isAlongY)
            cells.j0 = cells.j1 = cell;
        else
            cells.k0 = cells.k1 = cell;
        findInCells(level, cells, box, rows);
    }
}

bool ColumnGrid::isLongerAlongY(const RayPath& ray) const
{
    return std::abs(ray.direction[plan().tileAxisY]) >= std::abs(ray.direction[plan().tileAxisZ]);
}

std::uint32_t ColumnGrid::findNearRay(const RayPath& ray, const Aabb* boxes, RowSink& sink) const
{
    const Aabb around = ray.around(0.0, ray.length);
    const int across = isLongerAlongY(ray) ? plan().tileAxisZ : plan().tileAxisY;
    std::array<CellRect, kMaxLevels> cells;
    double count = 0;
    for (std::uint32_t level = 0; level < plan().levelCount; ++level)
    {
        cells[level] = cellsOf(around, cellBoundsOf(0.0f, level));
        const CellRect& all = cells[level];
        const double along = isLongerAlongY(ray) ? double(all.j1) - all.j0 : double(all.k1) - all.k0;
        count += (along + 1.0) * (2.0 + (ray.high[across] - ray.low[across]) * plan().inverseWidth[level]);
    }
    if (m_bold.empty() || !(count <= kMostFindCells))
        return 0;
    RowBatch rows(boxes, sink);
    for (std::uint32_t level = 0; level < plan().levelCount; ++level)
        followRay(level, ray, cells[level], rows);
    findUnbounded(around, rows);
    return rows.cost();
}
}  // namespace cullet
