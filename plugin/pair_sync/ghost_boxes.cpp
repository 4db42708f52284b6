// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/ghost_boxes.h"

#include "cullet/base/bytes_of.h"
#include "cullet/base/simd_float8.inl"

#include <algorithm>
#include <cmath>
#include <new>

namespace cullet
{
namespace
{
/// Up to so many ghosts, a sort saves less than it costs.
constexpr std::uint32_t kUnsorted = 64;
/// The ghosts are sorted again when their blocks have become so many times as wide.
constexpr double kWorn = 1.5;

void enclose(Aabb& bounds, const Aabb& box) noexcept
{
    for (int axis = 0; axis < 3; ++axis)
    {
        bounds.min[axis] = std::min(bounds.min[axis], box.min[axis]);
        bounds.max[axis] = std::max(bounds.max[axis], box.max[axis]);
    }
}

/// A finite number that grows with the place of the box; 0 for an empty box and one without bounds.
float centreOf(const Aabb& box, int axis) noexcept
{
    const float centre = 0.5f * box.min[axis] + 0.5f * box.max[axis];
    return std::isnan(centre) ? 0.0f : std::clamp(centre, -1e30f, 1e30f);
}
}  // namespace

GhostBoxes::Block GhostBoxes::emptyBlock() noexcept
{
    Block block;
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
        setBox(block, lane, kEmptyAabb);
    return block;
}

std::uint32_t GhostBoxes::overlapMask(const Block& block, const Aabb& box) noexcept
{
    Float8 isHit =
        (load(block.min[0]) <= broadcast(box.max[0])) & (broadcast(box.min[0]) <= load(block.max[0]));
    for (int axis = 1; axis < 3; ++axis)
        isHit = isHit & (load(block.min[axis]) <= broadcast(box.max[axis])) &
                (broadcast(box.min[axis]) <= load(block.max[axis]));
    return bits(isHit);
}

Aabb GhostBoxes::boxAt(const Block& block, std::uint32_t lane) noexcept
{
    return {{block.min[0][lane], block.min[1][lane], block.min[2][lane]},
            {block.max[0][lane], block.max[1][lane], block.max[2][lane]}};
}

void GhostBoxes::setBox(Block& block, std::uint32_t lane, const Aabb& box) noexcept
{
    for (int axis = 0; axis < 3; ++axis)
    {
        block.min[axis][lane] = box.min[axis];
        block.max[axis][lane] = box.max[axis];
    }
}

Aabb GhostBoxes::boundsOf(const Block& block) noexcept
{
    Aabb bounds = kEmptyAabb;
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
        enclose(bounds, boxAt(block, lane));
    return bounds;
}

/// Makes empty blocks for one more slot. If it throws, the tree has empty blocks too many, and works.
void GhostBoxes::growLevels()
{
    std::size_t blocks = m_size / kLanes + 1;
    for (std::size_t level = 0;; ++level)
    {
        if (m_levels.size() == level)
        {
            std::vector<Block> first(1, emptyBlock());
            const std::size_t children =
                level == 0 ? 0 : std::min<std::size_t>(m_levels[level - 1].size(), kLanes);
            for (std::uint32_t child = 0; child < children; ++child)
                setBox(first.front(), child, boundsOf(m_levels[level - 1][child]));
            m_levels.push_back(std::move(first));
        }
        while (m_levels[level].size() < blocks)
            m_levels[level].push_back(emptyBlock());
        if (blocks == 1)
            return;
        blocks = (blocks + kLanes - 1) / kLanes;
    }
}

void GhostBoxes::put(std::uint32_t slot, std::uint32_t row, const Aabb& box) noexcept
{
    m_rows[slot] = row;
    setBox(m_levels[0][slot / kLanes], slot % kLanes, box);
    std::uint32_t child = slot / kLanes;
    for (std::size_t level = 1; level < m_levels.size(); ++level, child /= kLanes)
    {
        Block& block = m_levels[level][child / kLanes];
        Aabb bounds = boxAt(block, child % kLanes);
        enclose(bounds, box);
        setBox(block, child % kLanes, bounds);
    }
    enclose(m_bounds, box);
    m_isLoose = true;
    ++m_changes;
}

void GhostBoxes::insert(std::uint32_t row, const Aabb& box)
{
    if (m_slots.size() <= row)
        m_slots.resize(row + 1 + row / 2, kNone);
    // A row for each lane, also for the free ones of the last block.
    if (m_rows.size() <= m_size)
        m_rows.resize((m_size + m_size / 2 + kLanes) / kLanes * kLanes, kNone);
    growLevels();
    m_slots[row] = m_size;
    put(m_size, row, box);
    ++m_size;
    // The ghosts of a new world are sorted each time that their number has doubled.
    if ((m_size & (m_size - 1)) == 0)
        tighten();
}

void GhostBoxes::set(std::uint32_t row, const Aabb& box) noexcept
{
    put(m_slots[row], row, box);
}

void GhostBoxes::erase(std::uint32_t row) noexcept
{
    const std::uint32_t hole = m_slots[row];
    const std::uint32_t last = --m_size;
    m_slots[row] = kNone;
    if (hole != last)
    {
        const std::uint32_t mover = m_rows[last];
        put(hole, mover, boxAt(m_levels[0][last / kLanes], last % kLanes));
        m_slots[mover] = hole;
    }
    put(last, kNone, kEmptyAabb);
}

void GhostBoxes::dropEmptyBlocks() noexcept
{
    std::size_t boxes = m_size;
    std::size_t level = 0;
    while (boxes > (level == 0 ? 0u : 1u))
    {
        boxes = (boxes + kLanes - 1) / kLanes;
        m_levels[level].resize(boxes);
        ++level;
    }
    m_levels.resize(level);
}

void GhostBoxes::tightenLevels() noexcept
{
    for (std::size_t level = 1; level < m_levels.size(); ++level)
    {
        const std::vector<Block>& below = m_levels[level - 1];
        for (std::size_t child = 0; child < below.size(); ++child)
            setBox(m_levels[level][child / kLanes], child % kLanes, boundsOf(below[child]));
    }
    m_bounds = m_levels.empty() ? kEmptyAabb : boundsOf(m_levels.back().front());
}

void GhostBoxes::tighten() noexcept
{
    if (!m_isLoose)
        return;
    dropEmptyBlocks();
    tightenLevels();
    if (m_size > kUnsorted && 8 * m_changes >= m_size && meanSpan() > kWorn * m_spanWhenSorted)
    {
        try
        {
            sortByPlace();
        }
        catch (const std::bad_alloc&)
        {
            // In any other order queries test more blocks.
        }
    }
    m_isLoose = false;
}

/// Mean extent of the blocks with bounds, summed over the axes.
double GhostBoxes::meanSpan() const noexcept
{
    double sum = 0.0;
    for (const Block& block : m_levels.front())
    {
        const Aabb bounds = boundsOf(block);
        for (int axis = 0; axis < 3; ++axis)
        {
            const double span = double(bounds.max[axis]) - double(bounds.min[axis]);
            sum += std::isfinite(span) ? span : 0.0;
        }
    }
    return sum / static_cast<double>(m_levels.front().size());
}

/// Sorts the ghosts so that those of a block, and blocks of a block, are near each other: halves along the axis of the
/// widest spread, of which the first one has a power of two of blocks.
void GhostBoxes::divide(Ghost* first, Ghost* last) noexcept
{
    while (last - first > std::ptrdiff_t{kLanes})
    {
        int widest = 0;
        float spread = -1.0f;
        for (int axis = 0; axis < 3; ++axis)
        {
            const auto isBefore = [axis](const Ghost& a, const Ghost& b)
            { return a.centre[axis] < b.centre[axis]; };
            const auto [low, high] = std::minmax_element(first, last, isBefore);
            if (high->centre[axis] - low->centre[axis] <= spread)
                continue;
            spread = high->centre[axis] - low->centre[axis];
            widest = axis;
        }
        std::ptrdiff_t half = kLanes;
        while (2 * half < last - first)
            half *= 2;
        std::nth_element(first, first + half, last,
                         [widest](const Ghost& a, const Ghost& b)
                         { return a.centre[widest] < b.centre[widest]; });
        divide(first, first + half);
        first += half;
    }
}

void GhostBoxes::sortByPlace()
{
    std::vector<Ghost> ghosts(m_size);
    for (std::uint32_t slot = 0; slot < m_size; ++slot)
    {
        Ghost& ghost = ghosts[slot];
        ghost.box = boxAt(m_levels[0][slot / kLanes], slot % kLanes);
        ghost.row = m_rows[slot];
        for (int axis = 0; axis < 3; ++axis)
            ghost.centre[axis] = centreOf(ghost.box, axis);
    }
    divide(ghosts.data(), ghosts.data() + ghosts.size());
    for (std::uint32_t slot = 0; slot < m_size; ++slot)
    {
        setBox(m_levels[0][slot / kLanes], slot % kLanes, ghosts[slot].box);
        m_rows[slot] = ghosts[slot].row;
        m_slots[ghosts[slot].row] = slot;
    }
    tightenLevels();
    m_changes = 0;
    m_spanWhenSorted = meanSpan();
}

std::uint64_t GhostBoxes::bytes() const noexcept
{
    std::uint64_t sum = bytesOf(m_levels, m_rows, m_slots);
    for (const std::vector<Block>& level : m_levels)
        sum += bytesOf(level);
    return sum;
}

void GhostBoxes::clear()
{
    *this = GhostBoxes();
}
}  // namespace cullet
