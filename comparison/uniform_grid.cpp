// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/uniform_grid.h"

#include <cmath>

namespace cullet
{
std::int32_t cellOf(float x, int sizeExponent) noexcept
{
    // Exact: a double represents every float times every admissible power of two.
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

UniformGrid::UniformGrid(int sizeExponent, const Options& options)
    : m_sizeExponent(sizeExponent),
      m_storesOneCell(options.storesOneCell),
      m_pairCounts(options.pairCounts),
      m_directory(options.storage, options.bucketCount)
{
}

CellRange UniformGrid::rangeOf(const Aabb& box) const noexcept
{
    CellRange cells = cellsOf(box, m_sizeExponent);
    if (m_storesOneCell)
        std::copy(cells.low, cells.low + 3, cells.high);
    return cells;
}

std::uint32_t UniformGrid::addCell(const CellNumber& cell)
{
    const std::uint32_t number = m_cells.take();
    m_cells.items[number] = {{kNone, kNone}};
    m_directory.insert(cell, number);
    return number;
}

void UniformGrid::removeCell(std::uint32_t number)
{
    m_directory.erase(number);
    m_cells.giveBack(number);
}

/// Calls visit(row) for the ids of a cell that count as partners of an id: bold x regular and bold x bold.
template <class Visit>
void UniformGrid::forEachCounted(const Cell& cell, Mark mark, Visit visit) const
{
    for (const Mark other : {Mark::Bold, Mark::Regular})
    {
        if (mark == Mark::Regular && other == Mark::Regular)
            break;
        std::uint32_t number = cell.firstEntry[static_cast<int>(other)];
        for (; number != kNone; number = m_entries.items[number].nextInCell)
            visit(m_entries.items[number].rowAndMark >> 1);
    }
}

void UniformGrid::addEntry(std::uint32_t row, Mark mark, const CellNumber& cell)
{
    std::uint32_t cellNumber = m_directory.find(cell);
    if (cellNumber == kNone)
        cellNumber = addCell(cell);
    if (m_pairCounts != nullptr)
        forEachCounted(m_cells.items[cellNumber], mark,
                       [&](std::uint32_t other) { m_pairCounts->add(row, other); });
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
    const std::uint32_t mark = entry.rowAndMark & 1;
    if (entry.nextInCell != kNone)
        m_entries.items[entry.nextInCell].previousInCell = entry.previousInCell;
    if (entry.previousInCell != kNone)
        m_entries.items[entry.previousInCell].nextInCell = entry.nextInCell;
    else
        cell.firstEntry[mark] = entry.nextInCell;
    if (m_pairCounts != nullptr)
        forEachCounted(cell, static_cast<Mark>(mark),
                       [&](std::uint32_t other) { m_pairCounts->subtract(entry.rowAndMark >> 1, other); });
    if (cell.firstEntry[0] == kNone && cell.firstEntry[1] == kNone)
        removeCell(entry.cell);
    m_entries.giveBack(number);
    ++m_touchedTotal;
}

void UniformGrid::addEntries(std::uint32_t row, Mark mark, const CellRange& cells, const CellRange* except)
{
    cells.forEach(
        [&](const CellNumber& cell)
        {
            if (except == nullptr || !except->contains(cell))
                addEntry(row, mark, cell);
        });
}

void UniformGrid::addBox(std::uint32_t row, const Aabb& box, Mark mark)
{
    if (row >= m_boxes.size())
        m_boxes.resize(std::max<std::size_t>(row + 1, 2 * m_boxes.size()));
    m_boxes[row].cells = rangeOf(box);
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
    const CellRange after = rangeOf(box);
    if (before == after)
        return;
    stored.cells = after;
    const Mark mark = static_cast<Mark>(m_entries.items[stored.firstEntry].rowAndMark & 1);
    for (std::uint32_t* link = &stored.firstEntry; *link != kNone;)
    {
        const std::uint32_t number = *link;
        Entry& entry = m_entries.items[number];
        if (after.contains(m_directory.cellAt(entry.cell)))
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
    m_directory.clear();
    m_cells.clear();
    m_entries.clear();
    m_boxes.clear();
}

UniformGrid::Counters UniformGrid::counters() const
{
    return {m_cells.usedCount(), m_entries.usedCount(), m_touchedTotal, m_visitedTotal};
}

std::uint64_t UniformGrid::bytes() const
{
    return m_directory.bytes() + m_cells.bytes() + m_entries.bytes() + m_boxes.capacity() * sizeof(StoredBox);
}
}  // namespace cullet
