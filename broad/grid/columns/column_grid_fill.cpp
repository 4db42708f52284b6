// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Fills the column grid: finds the cells of each box, inserts the box into the list of a task and counts the entries.
#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/broad/grid/columns/cell_bounds.h"
#include "cullet/broad/grid/columns/column_grid.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <tuple>
#include <utility>

namespace cullet
{
namespace
{
// The sizes of one box in so many are recorded, and those of all boxes that do not fit the plan.
constexpr std::uint32_t kSizeSampling = 8;
constexpr std::uint32_t kLocateBlock = 128;
constexpr std::uint32_t kFillSample = 512;
constexpr float kLargestExtent = static_cast<float>(std::uint64_t{1} << kHighestOctave);

/// Interval of the numbers without the outer 1/64 on either side; reorders them.
template <class T>
std::pair<T, T> usualRange(std::vector<T>& numbers)
{
    const auto few = static_cast<std::ptrdiff_t>(numbers.size() / 64);
    const auto high = numbers.end() - 1 - few;
    std::nth_element(numbers.begin(), numbers.begin() + few, numbers.end());
    const T low = numbers[static_cast<std::size_t>(few)];
    std::nth_element(numbers.begin(), high, numbers.end());
    return {low, *high};
}

/// Interval of most cells, with some room on both sides, but not more than all cells need.
std::pair<std::int64_t, std::int64_t> windowOf(std::vector<std::int32_t>& cells)
{
    const auto [lowest, highest] = std::minmax_element(cells.begin(), cells.end());
    const std::int64_t first = std::int64_t{*lowest} - 1;
    const std::int64_t last = std::int64_t{*highest} + 2;
    const auto [low, high] = usualRange(cells);
    const std::int64_t room = (std::int64_t{high} - low) / 8 + 2;
    return {std::max(first, low - room), std::min(last, high + room)};
}
}  // namespace

std::int64_t ColumnGrid::cellCountOf(const CellRect& cells)
{
    return (static_cast<std::int64_t>(cells.j1) - cells.j0 + 1) *
           (static_cast<std::int64_t>(cells.k1) - cells.k0 + 1);
}

ColumnGrid::BoxKind ColumnGrid::kindOf(const Aabb& box, float grow)
{
    const Float4 extent = extentsOf(box);
    // NaN, the extent of a box with a NaN and of one that lies at infinity, fails both comparisons.
    if (isTrueInAll((extent >= 0.0f) & (extent <= kLargestExtent - 4.0f * grow)))
        return BoxKind::Bounded;
    return isValid(box) ? BoxKind::Unbounded : BoxKind::Empty;
}

std::size_t ColumnGrid::octaveIndex(Float4 tile)
{
    const float larger = std::max(tile[1] - tile[0], tile[3] - tile[2]);
    const std::int32_t octave = std::min(std::max(octaveOf(larger), kLowestOctave), kHighestOctave);
    return static_cast<std::size_t>(octave - kLowestOctave);
}

void ColumnGrid::recordSize(const Aabb& grown, Task& task) const
{
    const Float4 tile = tileOf(grown);
    SizeHistogram::Bin& bin = task.sizes.bins[octaveIndex(tile)];
    task.sizes.weight = kSizeSampling;
    bin.count += kSizeSampling;
    bin.tileSum += 0.5f * kSizeSampling * ((tile[1] - tile[0]) + (tile[3] - tile[2]));
    bin.sweepSum += kSizeSampling * (grown.max[plan().sweepAxis] - grown.min[plan().sweepAxis]);
}

Float4 ColumnGrid::tileOf(const Aabb& box) const
{
    return Float4{box.min[plan().tileAxisY], box.max[plan().tileAxisY], box.min[plan().tileAxisZ],
                  box.max[plan().tileAxisZ]};
}

CellRect ColumnGrid::cellsOf(const Aabb& box, const CellBounds& cellBounds) const
{
    const Int4 cells = cellsOfFaces(tileOf(box), cellBounds);
    return {cells[0], cells[1], cells[2], cells[3]};
}

/// Finds the cells of a box at its level; returns false for an empty or unbounded box.
bool ColumnGrid::locateOne(const GridInput& input, std::uint32_t index, Task& task, LocatedBox& to) const
{
    const std::uint32_t proxyRow = input.proxyRows != nullptr ? input.proxyRows[index] : index;
    const BoxKind kind = kindOf(input.boxes[proxyRow], input.grow);
    if (kind == BoxKind::Unbounded)
        task.unbounded.push_back(proxyRow);
    if (kind != BoxKind::Bounded)
        return false;
    const Aabb box = grown(input.boxes[proxyRow], input.grow);
    const std::uint32_t level = plan().levelCount == 1 ? 0u : plan().levelOfOctave[octaveIndex(tileOf(box))];
    to = {cellsOf(box, cellBoundsOf(input.cellSkin, level)), proxyRow, static_cast<std::int32_t>(level)};
    if (!areTooManyCells(to.cells))
        return true;
    task.unbounded.push_back(proxyRow);
    if (index % kSizeSampling != 0)
        recordSize(box, task);
    return false;
}

void ColumnGrid::sampleSizes(const GridInput& input, std::uint32_t begin, std::uint32_t end, Task& task) const
{
    for (std::uint32_t i = (begin + kSizeSampling - 1) / kSizeSampling * kSizeSampling; i < end;
         i += kSizeSampling)
    {
        const Aabb& box = input.boxes[input.proxyRows != nullptr ? input.proxyRows[i] : i];
        if (kindOf(box, input.grow) == BoxKind::Bounded)
            recordSize(grown(box, input.grow), task);
    }
}

/// Finds the cells of the boxes [begin, end), at most a block, and writes them to `block`; lists the unbounded boxes.
///
/// The branches of the insertion are hard to predict; without them this loop runs at full speed.
std::uint32_t ColumnGrid::locate(const GridInput& input, std::uint32_t begin, std::uint32_t end, Task& task,
                                 LocatedBox* block) const
{
    sampleSizes(input, begin, end, task);
    std::uint32_t outliers[kLocateBlock];
    LocatedCounts counts = {0, 0};
    if (plan().levelCount == 1)
    {
        const CellBounds cellBounds = cellBoundsOf(input.cellSkin, 0);
        counts = m_kernels.locateBoxes(
            {input.boxes, input.proxyRows, plan().sweepAxis, input.grow, cellBounds.grow,
             cellBounds.inverseWidth, kLargestExtent - 4.0f * input.grow, kSquareSide},
            begin, end, block, outliers);
    }
    else
    {
        counts.outliers = end - begin;
        std::iota(outliers, outliers + counts.outliers, begin);
    }
    for (std::uint32_t i = 0; i < counts.outliers; ++i)
        counts.plain += locateOne(input, outliers[i], task, block[counts.plain]) ? 1u : 0u;
    return counts.plain;
}

bool ColumnGrid::insertByHash(const LocatedBox& box, Task& task)
{
    const CellRect& cells = box.cells;
    for (std::int32_t j = cells.j0; j <= cells.j1; ++j)
    {
        for (std::int32_t k = cells.k0; k <= cells.k1; ++k)
        {
            const std::uint32_t column = m_columns.findOrInsert(packCell(box.level, j, k));
            if (column == ColumnHash::kNone)
                return false;
            task.bold.push({column, tagRow(box.proxyRow, j == cells.j0, k == cells.k0)});
        }
    }
    return true;
}

/// Inserts boxes into the cells of their level and counts the entries of each; returns false when the ColumnHash is
/// full.
bool ColumnGrid::insertBold(const LocatedBox* block, std::uint32_t count, Task& task)
{
    // Local copies: the writes might alias members, which the compiler would read again for each box.
    const CellWindow window = m_columns.window();
    task.bold.makeRoom(static_cast<std::size_t>(count) * kMaxCells);
    const std::size_t before = task.bold.size();
    Entry* to = task.bold.end();
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const CellRect cells = block[i].cells;
        const std::int32_t spans = (cells.j1 - cells.j0) | (cells.k1 - cells.k0);
        if (spans > 1 || !window.containsSquare(cells.j0, cells.k0))
        {
            task.bold.setEnd(to);
            if (!insertByHash(block[i], task))
                return false;
            to = task.bold.end();
            continue;
        }
        // Without a branch: whether a box crosses into the next cell is hard to predict.
        const std::uint32_t crossesY = cells.j1 != cells.j0 ? 1 : 0;
        const std::uint32_t crossesZ = cells.k1 != cells.k0 ? 1 : 0;
        const std::uint32_t column = window.column(cells.j0, cells.k0);
        const std::uint32_t proxyRow = block[i].proxyRow;
        *to++ = {column, tagRow(proxyRow, true, true)};
        *to = {column + 1, tagRow(proxyRow, true, false)};
        to += crossesZ;
        *to = {column + window.countK, tagRow(proxyRow, false, true)};
        to += crossesY;
        *to = {column + window.countK + 1, proxyRow};
        to += crossesY & crossesZ;
    }
    task.bold.setEnd(to);
    std::uint32_t* const counts = task.boldCount.data();
    for (const Entry* entry = task.bold.begin() + before; entry != to; ++entry)
        ++counts[entry->column];
    return true;
}

void ColumnGrid::fillBold(const GridInput& input, std::uint32_t begin, std::uint32_t end, Task& task)
{
    LocatedBox block[kLocateBlock];
    for (std::uint32_t i = begin; i < end && !task.isFull; i += kLocateBlock)
    {
        const std::uint32_t last = std::min(end, i + kLocateBlock);
        const std::uint32_t count = locate(input, i, last, task, block);
        task.isFull = !insertBold(block, count, task);
    }
}

void ColumnGrid::fillRegular(const GridInput& input, std::uint32_t begin, std::uint32_t end, Task& task)
{
    for (std::uint32_t i = begin; i < end; ++i)
    {
        const std::uint32_t proxyRow = input.proxyRows != nullptr ? input.proxyRows[i] : i;
        if (kindOf(input.boxes[proxyRow], input.grow) != BoxKind::Bounded)
            continue;
        const Aabb box = grown(input.boxes[proxyRow], input.grow);
        const std::uint32_t own = plan().levelOfOctave[octaveIndex(tileOf(box))];
        if (areTooManyCells(cellsOf(box, cellBoundsOf(input.cellSkin, own))))
            continue;
        for (std::uint32_t level = own + 1; level < plan().levelCount; ++level)
        {
            const CellRect cells = cellsOf(box, cellBoundsOf(input.cellSkin, level));
            task.regular.makeRoom(static_cast<std::size_t>(cellCountOf(cells)));
            for (std::int32_t j = cells.j0; j <= cells.j1; ++j)
            {
                for (std::int32_t k = cells.k0; k <= cells.k1; ++k)
                {
                    const std::uint32_t column =
                        m_columns.find(packCell(static_cast<std::int32_t>(level), j, k));
                    if (column == ColumnHash::kNone)
                        continue;
                    ++task.regularCount[column];
                    task.regular.push({column, tagRow(proxyRow, j == cells.j0, k == cells.k0)});
                }
            }
        }
    }
}

bool ColumnGrid::tryFill(const GridInput& input)
{
    m_columns.reset(m_columnCapacity, m_bucketCount, m_window);
    const std::uint32_t columns = m_columns.capacity();
    for (unsigned t = 0; t < m_taskCount; ++t)
    {
        Task& task = m_tasks[t];
        task.bold.clear();
        task.regular.clear();
        task.unbounded.clear();
        task.boldCount.assign(columns, 0);
        task.regularCount.assign(plan().levelCount > 1 ? columns : 0, 0);
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
    if (plan().levelCount > 1)
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

/// The window of cells that most boxes touch; empty where a table of them would be large.
CellWindow ColumnGrid::chooseWindow(std::vector<std::int32_t>& js, std::vector<std::int32_t>& ks,
                                    std::uint32_t boxes) const
{
    if (plan().levelCount != 1 || m_bucketCount != 0 || js.empty())
        return {};
    const auto [firstJ, lastJ] = windowOf(js);
    const auto [firstK, lastK] = windowOf(ks);
    const std::int64_t countJ = lastJ - firstJ + 1;
    const std::int64_t countK = lastK - firstK + 1;
    if (countJ * countK > boxes / 4 + 64)
        return {};
    return {static_cast<std::int32_t>(firstJ), static_cast<std::int32_t>(firstK),
            static_cast<std::uint32_t>(countJ), static_cast<std::uint32_t>(countK)};
}

/// Estimates from a sample where boxes are.
void ColumnGrid::sampleInput(const GridInput& input)
{
    std::vector<std::int32_t> js;
    std::vector<std::int32_t> ks;
    std::vector<float> starts;
    const std::uint32_t stride = std::max(1u, input.count / kFillSample) | 1u;
    for (std::uint32_t i = 0; i < input.count; i += stride)
    {
        const Aabb& box = input.boxes[input.proxyRows != nullptr ? input.proxyRows[i] : i];
        if (kindOf(box, input.grow) != BoxKind::Bounded)
            continue;
        const CellRect cells = cellsOf(box, cellBoundsOf(input.cellSkin, 0));
        js.push_back(cells.j0);
        ks.push_back(cells.k0);
        starts.push_back(box.min[plan().sweepAxis]);
    }
    m_window = chooseWindow(js, ks, input.count);
    std::tie(m_sweepLow, m_sweepHigh) = starts.empty() ? std::pair(0.0f, 0.0f) : usualRange(starts);
}

bool ColumnGrid::isForOneThread(std::uint32_t count) const
{
    return m_workers.tasksFor(count, kTaskGrain) == 1;
}

/// The sizes of some boxes, for a first plan.
SizeHistogram ColumnGrid::sizesOfSample(const GridInput& input)
{
    SizeHistogram sizes;
    const std::uint32_t stride = std::max(1u, input.count / 1024);
    sizes.weight = stride;
    for (std::uint32_t i = 0; i < input.count; i += stride)
    {
        const Aabb& box = input.boxes[input.proxyRows != nullptr ? input.proxyRows[i] : i];
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
    return sizes;
}

void ColumnGrid::makePlan(const GridInput& input, const SizeHistogram& sizes)
{
    m_planner.make(input.boxes, input.proxyRows, input.count, input.cellSkin, sizes);
}

void ColumnGrid::fill(const GridInput& input)
{
    m_taskCount = m_workers.tasksFor(input.count, kTaskGrain);
    if (m_tasks.size() < m_taskCount)
        m_tasks.resize(m_taskCount);
    if (!m_planner.hasPlan())
        makePlan(input, sizesOfSample(input));
    for (int attempt = 0;; ++attempt)
    {
        sampleInput(input);
        while (!tryFill(input))
            m_columnCapacity *= 2;
        SizeHistogram sizes;
        for (unsigned t = 0; t < m_taskCount; ++t)
            sizes.add(m_tasks[t].sizes);
        if (attempt > 0 || !m_planner.isStale(sizes, input.cellSkin))
            break;
        makePlan(input, sizes);
    }
    // Room for twice the columns in use, so that the next frames need no second attempt.
    const std::uint32_t used = m_columns.count() - m_columns.window().count();
    if (m_columnCapacity > 8 * used + 1024)
        m_columnCapacity /= 2;
}
}  // namespace cullet
