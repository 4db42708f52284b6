// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/cell_grid.h"

#include <algorithm>
#include <cmath>

namespace cullet
{
namespace
{
constexpr int kCellBits = 30;  // kLastCell is 2^30

/// Largest extent of a box. In double: the float difference of two powers of two may round to a third power of two.
double sizeOf(const Aabb& box) noexcept
{
    double size = 0;
    for (int axis = 0; axis < 3; ++axis)
        size = std::max(size, static_cast<double>(box.max[axis]) - static_cast<double>(box.min[axis]));
    return size;
}

/// Largest absolute coordinate of a box.
float reachOf(const Aabb& box) noexcept
{
    float reach = 0;
    for (int axis = 0; axis < 3; ++axis)
        reach = std::max({reach, std::fabs(box.min[axis]), std::fabs(box.max[axis])});
    return reach;
}

/// Finest level whose cell numbers do not saturate within `reach` of the origin.
int finestLevelWithin(float reach) noexcept
{
    int exponent = CellGrid::kFinestLevel;
    if (reach > 0)
        std::frexp(reach, &exponent);  // reach < 2^exponent
    return exponent - kCellBits;
}
}  // namespace

int levelOfBox(const Aabb& box, double b) noexcept
{
    const double size = sizeOf(box);
    const float reach = reachOf(box);
    if (std::isinf(reach) || size > std::ldexp(b, CellGrid::kCoarsestLevel))
        return CellGrid::kUnbounded;
    int level = CellGrid::kFinestLevel;
    if (size > 0)
    {
        // ilogb() of the rounded quotient is off by one at most; the products are exact.
        level = std::max(level, std::ilogb(size / b) - 1);
        while (size > std::ldexp(b, level))
            ++level;
    }
    return std::max(level, finestLevelWithin(reach));
}

int levelOfMeanBox(const Aabb* boxes, std::uint32_t count, double b) noexcept
{
    double sum = 0;
    double bounded = 0;
    int level = CellGrid::kFinestLevel;
    for (std::uint32_t row = 0; row < count; ++row)
    {
        if (!isValid(boxes[row]) || levelOfBox(boxes[row], b) == CellGrid::kUnbounded)
            continue;
        sum += sizeOf(boxes[row]);
        ++bounded;
        level = std::max(level, finestLevelWithin(reachOf(boxes[row])));
    }
    const double cell = bounded > 0 ? sum / bounded / b : 0;
    while (level < CellGrid::kCoarsestLevel && std::ldexp(1.0, level) < cell)
        ++level;
    return level;
}

CellGrid::CellGrid(const CellGridOptions& options) : m_options(options) {}

int CellGrid::levelOf(const Aabb& box) const noexcept
{
    const int own = levelOfBox(box, m_options.b);
    if (m_options.placement != GridPlacement::OneGrid || own == kUnbounded)
        return own;
    return cellsOf(box, m_commonLevel).count() <= kMostCells ? m_commonLevel : kUnbounded;
}

bool CellGrid::mayStayAtLevel(const Aabb& box, int level) const noexcept
{
    const int finest = levelOf(box);
    if (level == finest)
        return true;
    return finest < level && level <= kCoarsestLevel && sizeOf(box) > std::ldexp(m_options.a, level);
}

/// The cells of a level in which boxes that overlap this one may be stored.
CellRange CellGrid::searchRange(const Aabb& box, int level) const noexcept
{
    Aabb reach = box;
    if (m_options.placement == GridPlacement::OnePoint)
    {
        // No box of the level is longer than this, so the lowest corner of an overlapping box lies at most this far
        // below. Rounding is monotone: a float that is not below the exact difference is not below the rounded one.
        const float longest = roundUpToFloat(std::ldexp(m_options.b, level));
        for (float& coordinate : reach.min)
            coordinate -= longest;
    }
    return cellsOf(reach, level);
}

CellGrid::Level& CellGrid::levelWithGrid(int level)
{
    const auto isFiner = [](const std::unique_ptr<Level>& existing, int exponent)
    { return existing->grid.sizeExponent() < exponent; };
    auto place = std::lower_bound(m_levels.begin(), m_levels.end(), level, isFiner);
    if (place != m_levels.end() && (*place)->grid.sizeExponent() == level)
        return **place;

    const UniformGrid::Options options = {m_options.bucketCount, m_options.storage,
                                          m_options.placement == GridPlacement::OnePoint,
                                          m_options.countsPairs ? &m_pairCounts : nullptr};
    place = m_levels.insert(place, std::make_unique<Level>(Level{UniformGrid(level, options), 0}));
    UniformGrid& grid = (*place)->grid;
    if (m_options.placement != GridPlacement::AllCoarser)
        return **place;
    for (std::uint32_t row = 0; row < m_boxes.size(); ++row)
    {
        if (m_boxes[row].level < level)
            grid.addBox(row, m_boxes[row].box, UniformGrid::Mark::Regular);
    }
    return **place;
}

void CellGrid::addToUnbounded(std::uint32_t row)
{
    m_boxes[row].unboundedIndex = static_cast<std::uint32_t>(m_unbounded.size());
    m_unbounded.push_back(row);
}

void CellGrid::removeFromUnbounded(std::uint32_t row)
{
    const std::uint32_t place = m_boxes[row].unboundedIndex;
    m_unbounded[place] = m_unbounded.back();
    m_boxes[m_unbounded[place]].unboundedIndex = place;
    m_unbounded.pop_back();
}

void CellGrid::addAtLevel(std::uint32_t row, const Aabb& box, int level)
{
    // The row gets its level only afterwards: a new grid inserts all rows of finer levels, and this row is inserted
    // below.
    if (level != kUnbounded)
        ++levelWithGrid(level).boldCount;
    m_boxes[row] = {box, level, 0};
    if (level == kUnbounded)
        return addToUnbounded(row);
    for (const auto& existing : m_levels)
    {
        UniformGrid& grid = existing->grid;
        if (!stores(grid, level))
            continue;
        const bool isBold = grid.sizeExponent() == level;
        grid.addBox(row, box, isBold ? UniformGrid::Mark::Bold : UniformGrid::Mark::Regular);
    }
}

void CellGrid::addBox(std::uint32_t row, const Aabb& box)
{
    if (row >= m_boxes.size())
        m_boxes.resize(std::max<std::size_t>(row + 1, 2 * m_boxes.size()));
    addAtLevel(row, box, levelOf(box));
}

void CellGrid::removeBox(std::uint32_t row)
{
    const int own = m_boxes[row].level;
    if (own == kUnbounded)
        removeFromUnbounded(row);
    for (const auto& level : m_levels)
    {
        if (!stores(level->grid, own))
            continue;
        level->grid.removeBox(row);
        if (level->grid.sizeExponent() == own)
            --level->boldCount;
    }
    m_boxes[row] = {};
}

void CellGrid::updateBox(std::uint32_t row, const Aabb& box)
{
    const int before = m_boxes[row].level;
    const int after = mayStayAtLevel(box, before) ? before : levelOf(box);
    if (before != after || m_options.updatesByRemoveAndAdd)
    {
        removeBox(row);
        addAtLevel(row, box, after);
        return;
    }
    m_boxes[row].box = box;
    for (const auto& level : m_levels)
    {
        if (stores(level->grid, before))
            level->grid.updateBox(row, box);
    }
}

void CellGrid::dropUnusedLevels()
{
    const auto isUnused = [this](const std::unique_ptr<Level>& level)
    {
        if (level->boldCount > 0)
            return false;
        m_touchedInDropped += level->grid.counters().touchedTotal;
        m_visitedInDropped += level->grid.counters().visitedTotal;
        return true;
    };
    m_levels.erase(std::remove_if(m_levels.begin(), m_levels.end(), isUnused), m_levels.end());
}

void CellGrid::clear()
{
    m_boxes.clear();
    m_unbounded.clear();
    m_pairCounts.clear();
    for (const auto& level : m_levels)
    {
        level->grid.clear();
        level->boldCount = 0;
    }
}

const UniformGrid* CellGrid::grid(int level) const
{
    for (const auto& existing : m_levels)
    {
        if (existing->grid.sizeExponent() == level)
            return &existing->grid;
    }
    return nullptr;
}

void CellGrid::forEachCell(const CellVisitor& visit) const
{
    for (std::uint32_t level = 0; level < m_levels.size(); ++level)
    {
        const UniformGrid& grid = m_levels[level]->grid;
        grid.forEachCell(
            [&](const CellNumber& cell)
            {
                Aabb box;
                for (int axis = 0; axis < 3; ++axis)
                {
                    const auto number = static_cast<double>(cell[axis]);
                    box.min[axis] = static_cast<float>(std::ldexp(number, grid.sizeExponent()));
                    box.max[axis] = static_cast<float>(std::ldexp(number + 1, grid.sizeExponent()));
                }
                visit(box, level);
            });
    }
}

CellGrid::Counters CellGrid::counters() const
{
    Counters sum;
    sum.levels = m_levels.size();
    sum.unbounded = m_unbounded.size();
    sum.touchedTotal = m_touchedInDropped;
    sum.visitedTotal = m_visitedInDropped;
    for (const auto& level : m_levels)
    {
        const UniformGrid::Counters counters = level->grid.counters();
        sum.cells += counters.cells;
        sum.ids += counters.ids;
        sum.touchedTotal += counters.touchedTotal;
        sum.visitedTotal += counters.visitedTotal;
    }
    return sum;
}

std::uint64_t CellGrid::bytes() const
{
    std::uint64_t sum = m_boxes.capacity() * sizeof(StoredBox) +
                        m_unbounded.capacity() * sizeof(std::uint32_t) + m_pairCounts.bytes();
    for (const auto& level : m_levels)
        sum += sizeof(Level) + level->grid.bytes();
    return sum;
}
}  // namespace cullet
