// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/uniform_grid.h"

#include <cmath>

namespace cullet
{
namespace
{
// First size of a table that grows, and odd as all its later ones (2n + 1): an odd modulus looks at all bits of the
// hash, while the low bits of the products, which a power of two would take, depend on the low bits of i, j, k only.
constexpr std::uint32_t kFirstBucketCount = 31;

/// Calls visit(cell) for every cell of a range, the first axis fastest.
template <class Visit>
void forEachCell(const CellRange& cells, Visit visit)
{
    std::int32_t cell[3];
    for (cell[2] = cells.low[2]; cell[2] <= cells.high[2]; ++cell[2])
    {
        for (cell[1] = cells.low[1]; cell[1] <= cells.high[1]; ++cell[1])
        {
            for (cell[0] = cells.low[0]; cell[0] <= cells.high[0]; ++cell[0])
                visit(cell);
        }
    }
}
}  // namespace

std::int32_t cellOf(float x, int sizeExponent) noexcept
{
    // Exact: a double holds every float times every power of two in question.
    const double position = std::floor(std::ldexp(static_cast<double>(x), -sizeExponent));
    if (!(position > -kLastCell))
        return -kLastCell;
    return position < kLastCell ? static_cast<std::int32_t>(position) : kLastCell;
}

bool operator==(const CellRange& a, const CellRange& b) noexcept
{
    return std::equal(a.low, a.low + 3, b.low) && std::equal(a.high, a.high + 3, b.high);
}

CellRange cellsOf(const Aabb& box, int sizeExponent) noexcept
{
    CellRange cells;
    for (int axis = 0; axis < 3; ++axis)
    {
        cells.low[axis] = cellOf(box.min[axis], sizeExponent);
        cells.high[axis] = cellOf(box.max[axis], sizeExponent);
    }
    return cells;
}

UniformGrid::UniformGrid(int sizeExponent, std::uint32_t bucketCount)
    : m_sizeExponent(sizeExponent),
      m_isGrowing(bucketCount == 0),
      m_buckets(bucketCount == 0 ? kFirstBucketCount : bucketCount, kNone)
{
}

std::uint32_t UniformGrid::findCell(const std::int32_t (&cell)[3]) const
{
    std::uint32_t number = m_buckets[bucketOf(cell)];
    while (number != kNone && !std::equal(cell, cell + 3, m_cells.items[number].number))
        number = m_cells.items[number].nextInBucket;
    return number;
}

std::uint32_t UniformGrid::addCell(const std::int32_t (&cell)[3])
{
    if (m_isGrowing && m_cells.usedCount() >= m_buckets.size())
        growBuckets();
    const std::uint32_t number = m_cells.take();
    std::uint32_t& first = m_buckets[bucketOf(cell)];
    m_cells.items[number] = {{cell[0], cell[1], cell[2]}, first, {kNone, kNone}};
    first = number;
    return number;
}

void UniformGrid::removeCell(std::uint32_t number)
{
    std::uint32_t* link = &m_buckets[bucketOf(m_cells.items[number].number)];
    while (*link != number)
        link = &m_cells.items[*link].nextInBucket;
    *link = m_cells.items[number].nextInBucket;
    m_cells.giveBack(number);
}

void UniformGrid::growBuckets()
{
    std::vector<std::uint32_t> old(2 * m_buckets.size() + 1, kNone);
    old.swap(m_buckets);
    for (std::uint32_t number : old)
    {
        while (number != kNone)
        {
            Cell& cell = m_cells.items[number];
            const std::uint32_t next = cell.nextInBucket;
            std::uint32_t& first = m_buckets[bucketOf(cell.number)];
            cell.nextInBucket = first;
            first = number;
            number = next;
        }
    }
}

void UniformGrid::addEntry(std::uint32_t row, Mark mark, const std::int32_t (&cell)[3])
{
    std::uint32_t cellNumber = findCell(cell);
    if (cellNumber == kNone)
        cellNumber = addCell(cell);
    const std::uint32_t number = m_entries.take();
    std::uint32_t& first = m_cells.items[cellNumber].firstEntry[static_cast<int>(mark)];
    if (first != kNone)
        m_entries.items[first].previousInCell = number;
    m_entries.items[number] = {row << 1 | static_cast<std::uint32_t>(mark), cellNumber, kNone, first,
                               m_boxes[row].firstEntry};
    first = number;
    m_boxes[row].firstEntry = number;
    ++m_touchedTotal;
}

void UniformGrid::removeEntry(std::uint32_t number)
{
    const Entry entry = m_entries.items[number];
    Cell& cell = m_cells.items[entry.cell];
    if (entry.nextInCell != kNone)
        m_entries.items[entry.nextInCell].previousInCell = entry.previousInCell;
    if (entry.previousInCell != kNone)
        m_entries.items[entry.previousInCell].nextInCell = entry.nextInCell;
    else
        cell.firstEntry[entry.rowAndMark & 1] = entry.nextInCell;
    if (cell.firstEntry[0] == kNone && cell.firstEntry[1] == kNone)
        removeCell(entry.cell);
    m_entries.giveBack(number);
    ++m_touchedTotal;
}

void UniformGrid::addEntries(std::uint32_t row, Mark mark, const CellRange& cells, const CellRange* except)
{
    forEachCell(cells,
                [&](const std::int32_t(&cell)[3])
                {
                    if (except == nullptr || !except->contains(cell))
                        addEntry(row, mark, cell);
                });
}

void UniformGrid::addBox(std::uint32_t row, const Aabb& box, Mark mark)
{
    if (row >= m_boxes.size())
        m_boxes.resize(std::max<std::size_t>(row + 1, 2 * m_boxes.size()));
    m_boxes[row].cells = cellsOf(box, m_sizeExponent);
    addEntries(row, mark, m_boxes[row].cells, nullptr);
}

void UniformGrid::removeBox(std::uint32_t row)
{
    std::uint32_t number = m_boxes[row].firstEntry;
    while (number != kNone)
    {
        const std::uint32_t next = m_entries.items[number].nextOfBox;
        removeEntry(number);
        number = next;
    }
    m_boxes[row].firstEntry = kNone;
}

void UniformGrid::updateBox(std::uint32_t row, const Aabb& box)
{
    StoredBox& stored = m_boxes[row];
    const CellRange before = stored.cells;
    const CellRange after = cellsOf(box, m_sizeExponent);
    if (before == after)
        return;
    stored.cells = after;
    const Mark mark = static_cast<Mark>(m_entries.items[stored.firstEntry].rowAndMark & 1);
    for (std::uint32_t* link = &stored.firstEntry; *link != kNone;)
    {
        const std::uint32_t number = *link;
        Entry& entry = m_entries.items[number];
        if (after.contains(m_cells.items[entry.cell].number))
        {
            link = &entry.nextOfBox;
            continue;
        }
        *link = entry.nextOfBox;
        removeEntry(number);
    }
    addEntries(row, mark, after, &before);
}

void UniformGrid::clear()
{
    std::fill(m_buckets.begin(), m_buckets.end(), kNone);
    m_cells.clear();
    m_entries.clear();
    m_boxes.clear();
}

UniformGrid::Counters UniformGrid::counters() const
{
    return {m_cells.usedCount(), m_entries.usedCount(), m_touchedTotal};
}

std::uint64_t UniformGrid::bytes() const
{
    return m_buckets.capacity() * sizeof(std::uint32_t) + m_cells.bytes() + m_entries.bytes() +
           m_boxes.capacity() * sizeof(StoredBox);
}
}  // namespace cullet
