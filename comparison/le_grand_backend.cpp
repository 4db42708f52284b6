// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/le_grand_backend.h"

#include "cullet/comparison/backends.h"
#include "cullet/comparison/cell_grid.h"

#include <algorithm>
#include <new>

namespace cullet
{
namespace
{
constexpr std::size_t kMostCells = 8;
constexpr std::uint64_t kUnused = ~0ull;  // cell id 0xFFFFFFFF
constexpr std::uint32_t kAllBits = 7;

/// Cell id: ten bits of the number on each axis. Cells 1,024 apart share an id, which only costs tests.
std::uint64_t idOf(const CellNumber& cell)
{
    constexpr std::uint32_t kMask = 1023;
    return (static_cast<std::uint32_t>(cell[0]) & kMask) |
           (static_cast<std::uint32_t>(cell[1]) & kMask) << 10 |
           (static_cast<std::uint32_t>(cell[2]) & kMask) << 20;
}
}  // namespace

/// Returns the level at which a bounded box touches at most two cells on an axis; lists bounded and unbounded boxes.
int LeGrandBackend::chooseLevel(const ProxyView& proxies)
{
    m_rows.clear();
    m_unbounded.clear();
    int coarsest = CellGrid::kFinestLevel;
    for (std::uint32_t row = 0; row < proxies.size; ++row)
    {
        if (!isValid(proxies.boxes[row]))
            continue;
        const int level = levelOfBox(proxies.boxes[row], 1.0);
        (level == CellGrid::kUnbounded ? m_unbounded : m_rows).push_back(row);
        coarsest = std::max(coarsest, level == CellGrid::kUnbounded ? coarsest : level);
    }
    // A box as large as a cell may touch a third one: its size is rounded.
    const auto isTooLarge = [&](std::uint32_t row)
    {
        const CellRange cells = cellsOf(proxies.boxes[row], coarsest);
        return cells.high[0] - cells.low[0] > 1 || cells.high[1] - cells.low[1] > 1 ||
               cells.high[2] - cells.low[2] > 1;
    };
    while (std::any_of(m_rows.begin(), m_rows.end(), isTooLarge))
        ++coarsest;
    return coarsest;
}

void LeGrandBackend::fillCells(const ProxyView& proxies, int level)
{
    m_cells.assign(kMostCells * m_rows.size(), kUnused);
    m_stats.entries = 0;
    for (std::size_t index = 0; index < m_rows.size(); ++index)
    {
        const CellRange cells = cellsOf(proxies.boxes[m_rows[index]], level);
        std::size_t slot = kMostCells * index;
        cells.forEach(
            [&](const CellNumber& cell)
            {
                std::uint64_t bits = 0;
                for (int axis = 0; axis < 3; ++axis)
                    bits |= cell[axis] == cells.low[axis] ? 1u << axis : 0u;
                m_cells[slot++] = idOf(cell) << 32 | index << 3 | bits;
            });
        m_stats.entries += slot - kMostCells * index;
    }
    std::sort(m_cells.begin(), m_cells.end());
}

void LeGrandBackend::testCells(const ProxyView& proxies)
{
    m_comparisonStats.mostTests = 0;
    std::size_t begin = 0;
    while (begin < m_cells.size() && m_cells[begin] != kUnused)
    {
        std::size_t end = begin + 1;
        while (end < m_cells.size() && m_cells[end] >> 32 == m_cells[begin] >> 32)
            ++end;
        const std::uint64_t before = m_pairs.testCount();
        testCell(proxies, begin, end);
        m_comparisonStats.mostTests = std::max(m_comparisonStats.mostTests, m_pairs.testCount() - before);
        begin = end;
    }
}

void LeGrandBackend::testCell(const ProxyView& proxies, std::size_t begin, std::size_t end)
{
    for (std::size_t i = begin; i < end; ++i)
    {
        const std::uint32_t first = static_cast<std::uint32_t>(m_cells[i]);
        for (std::size_t j = i + 1; j < end; ++j)
        {
            const std::uint32_t second = static_cast<std::uint32_t>(m_cells[j]);
            if (((first | second) & kAllBits) == kAllBits)
                m_pairs.test(proxies, m_rows[first >> 3], m_rows[second >> 3]);
        }
    }
}

void LeGrandBackend::testUnbounded(const ProxyView& proxies)
{
    for (std::size_t i = 0; i < m_unbounded.size(); ++i)
    {
        for (const std::uint32_t row : m_rows)
            m_pairs.test(proxies, m_unbounded[i], row);
        for (std::size_t j = i + 1; j < m_unbounded.size(); ++j)
            m_pairs.test(proxies, m_unbounded[i], m_unbounded[j]);
    }
}

void LeGrandBackend::restart(const Pairs& known)
{
    m_pairs.restart(known);
    m_needsRebuild = true;
}

Status LeGrandBackend::update(const ProxyView& proxies, PairDelta& delta)
try
{
    delta.clear();
    m_pairs.begin(proxies);
    m_stats.path = "idle";
    if (!m_needsRebuild && proxies.dirtyCount == 0 && proxies.margin == m_margin)
        return Status::Ok;
    m_stats.path = "rebuild";
    ++m_stats.rebuildsTotal;
    m_needsRebuild = false;
    m_margin = proxies.margin;
    fillCells(proxies, chooseLevel(proxies));
    testCells(proxies);
    testUnbounded(proxies);
    m_pairs.finish(proxies, delta);
    return Status::Ok;
}
catch (const std::bad_alloc&)
{
    restart({});
    delta.clear();
    return Status::OutOfMemory;
}

BackendStats LeGrandBackend::stats() const
{
    BackendStats stats = m_stats;
    stats.pairs = m_pairs.size();
    stats.candidates = m_pairs.testCount();
    stats.levels = 1;
    stats.unbounded = m_unbounded.size();
    stats.bytes = m_pairs.bytes() + m_cells.capacity() * sizeof(std::uint64_t) +
                  (m_rows.capacity() + m_unbounded.capacity()) * sizeof(std::uint32_t);
    return stats;
}

std::unique_ptr<Backend> makeLeGrandBackend()
{
    return std::make_unique<LeGrandBackend>();
}
}  // namespace cullet
