// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/box_tree.h"

#include <algorithm>
#include <cmath>

namespace cullet
{
namespace
{
/// Boxes whose sizes share 2 of these octaves share leaves. Factor 4: measured best of 2, 4, 8, 16 on mixed sizes.
constexpr int kOctavesPerClass = 2;

constexpr Aabb kNoLimits = {{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};

struct Item
{
    float centre[3];
    ProxyId row;
};

struct Extent
{
    float min[3] = {INFINITY, INFINITY, INFINITY};
    float max[3] = {-INFINITY, -INFINITY, -INFINITY};
};

void include(Aabb& bounds, const Aabb& box) noexcept
{
    for (int axis = 0; axis < 3; ++axis)
    {
        bounds.min[axis] = std::min(bounds.min[axis], box.min[axis]);
        bounds.max[axis] = std::max(bounds.max[axis], box.max[axis]);
    }
}

/// @param inner valid or kEmptyAabb, which nothing contains
bool contains(const Aabb& outer, const Aabb& inner) noexcept
{
    return inner.min[0] <= inner.max[0] && inner.min[0] >= outer.min[0] && inner.min[1] >= outer.min[1] &&
           inner.min[2] >= outer.min[2] && inner.max[0] <= outer.max[0] && inner.max[1] <= outer.max[1] &&
           inner.max[2] <= outer.max[2];
}

double halfArea(const Aabb& box) noexcept
{
    const double x = static_cast<double>(box.max[0]) - box.min[0];
    const double y = static_cast<double>(box.max[1]) - box.min[1];
    const double z = static_cast<double>(box.max[2]) - box.min[2];
    return x >= 0.0 ? x * y + y * z + z * x : 0.0;
}

Aabb boundsOfLanes(const BoxNode& node) noexcept
{
    Aabb box;
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] = *std::min_element(node.planes[axis], node.planes[axis] + 8);
        box.max[axis] = *std::max_element(node.planes[axis + 3], node.planes[axis + 3] + 8);
    }
    return box;
}

Aabb laneBox(const BoxNode& node, std::uint32_t lane) noexcept
{
    return {{node.planes[0][lane], node.planes[1][lane], node.planes[2][lane]},
            {node.planes[3][lane], node.planes[4][lane], node.planes[5][lane]}};
}

void setLane(BoxNode& node, std::uint32_t lane, const Aabb& box) noexcept
{
    for (int axis = 0; axis < 3; ++axis)
    {
        node.planes[axis][lane] = box.min[axis];
        node.planes[axis + 3][lane] = box.max[axis];
    }
}

int widestAxis(const Item* begin, const Item* end) noexcept
{
    Extent extent;
    for (const Item* item = begin; item != end; ++item)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            extent.min[axis] = std::min(extent.min[axis], item->centre[axis]);
            extent.max[axis] = std::max(extent.max[axis], item->centre[axis]);
        }
    }
    int widest = 0;
    for (int axis = 1; axis < 3; ++axis)
    {
        if (extent.max[axis] - extent.min[axis] > extent.max[widest] - extent.min[widest])
            widest = axis;
    }
    return extent.max[widest] > extent.min[widest] ? widest : -1;
}

/// Moves the items whose key is below the pivot to the front and returns the first of the others.
///
/// Without a branch on the data: on random keys the mispredictions of std::nth_element cost five times as much.
template <class IsLow>
Item* partition(Item* begin, Item* end, IsLow isLow) noexcept
{
    Item* low = begin;
    for (Item* item = begin; item != end; ++item)
    {
        const Item moved = *item;
        *item = *low;
        *low = moved;
        low += isLow(moved) ? 1 : 0;
    }
    return low;
}

float medianOf(float a, float b, float c) noexcept
{
    return std::max(std::min(a, b), std::min(std::max(a, b), c));
}

/// Median of nine items spread over the range, an estimate of the middle key.
float pivotOf(const Item* begin, const Item* end, int axis) noexcept
{
    const std::ptrdiff_t step = (end - begin - 1) / 8;
    const auto key = [=](int i) { return begin[i * step].centre[axis]; };
    return medianOf(medianOf(key(0), key(1), key(2)), medianOf(key(3), key(4), key(5)),
                    medianOf(key(6), key(7), key(8)));
}

/// std::nth_element by one coordinate. Quickselect; after too many rounds, the standard one with its bound.
void selectByAxis(Item* begin, Item* nth, Item* end, int axis) noexcept
{
    for (int round = 0; end - begin > 16 && round < 32; ++round)
    {
        const float pivot = pivotOf(begin, end, axis);
        Item* const low = partition(begin, end, [=](const Item& item) { return item.centre[axis] < pivot; });
        if (nth < low)
        {
            end = low;
            continue;
        }
        begin = low;
        // Many equal keys: the pivot is the least of what is left, and all its equals may go at once.
        Item* const equal =
            partition(begin, end, [=](const Item& item) { return item.centre[axis] <= pivot; });
        if (nth < equal)
            return;
        begin = equal;
    }
    std::nth_element(begin, nth, end,
                     [axis](const Item& a, const Item& b) { return a.centre[axis] < b.centre[axis]; });
}

/// Orders the items of slots [begin, end) so that every node of a complete tree holds neighbours.
///
/// @param items    first item of the range
/// @param capacity slots under one child at the present level; a range never crosses a node of eight times that
void orderByMedians(Item* items, std::uint32_t begin, std::uint32_t end, std::uint32_t capacity)
{
    while (capacity >= 8)
    {
        const std::uint32_t first = begin / capacity;
        const std::uint32_t last = (end - 1) / capacity;
        if (first == last)
        {
            capacity /= 8;
            continue;
        }
        const std::uint32_t middle = (first + (last - first + 1) / 2) * capacity;
        const int axis = widestAxis(items, items + (end - begin));
        if (axis < 0)
            return;
        selectByAxis(items, items + (middle - begin), items + (end - begin), axis);
        orderByMedians(items, begin, middle, capacity);
        items += middle - begin;
        begin = middle;
    }
}

/// Class of a box: the order of magnitude of its largest side; all tiny boxes share class 0.
int sizeClass(const Aabb& box) noexcept
{
    const float size =
        std::max({box.max[0] - box.min[0], box.max[1] - box.min[1], box.max[2] - box.min[2], 1e-30f});
    return (std::ilogb(size) + 100) / kOctavesPerClass;
}
constexpr int kSizeClasses = 256 / kOctavesPerClass;

std::uint32_t roundUpToLeaf(std::uint32_t slots) noexcept
{
    return (slots + 7) / 8 * 8;
}
}  // namespace

void BoxTree::build(const Aabb* boxes, const std::vector<ProxyId>& rows)
{
    std::uint32_t counts[kSizeClasses] = {};
    for (const ProxyId row : rows)
        ++counts[sizeClass(boxes[row])];
    // Classes that would not fill a leaf join the next larger one.
    int target[kSizeClasses];
    std::uint32_t starts[kSizeClasses + 1] = {};
    int open = 0;
    std::uint32_t held = 0;
    std::uint32_t slots = 0;
    for (int c = 0; c < kSizeClasses; ++c)
    {
        target[c] = open;
        held += counts[c];
        if (held < 64 && c + 1 < kSizeClasses)
            continue;
        starts[open] = slots;
        slots = roundUpToLeaf(slots + held);
        held = 0;
        ++open;
    }
    std::uint32_t next[kSizeClasses];
    std::copy(starts, starts + kSizeClasses, next);
    std::vector<Item> items(slots, Item{{0.0f, 0.0f, 0.0f}, kNoRow});
    for (const ProxyId row : rows)
    {
        const Aabb& box = boxes[row];
        items[next[target[sizeClass(box)]]++] = {
            {0.5f * box.min[0] + 0.5f * box.max[0], 0.5f * box.min[1] + 0.5f * box.max[1],
             0.5f * box.min[2] + 0.5f * box.max[2]},
            row};
    }
    layOut(slots);
    std::uint32_t capacity = 8;
    while (capacity < slots && capacity < 0x10000000u)
        capacity *= 8;
    for (int c = 0; c < open; ++c)
    {
        if (next[c] > starts[c])
            orderByMedians(items.data() + starts[c], starts[c], next[c], capacity);
    }
    for (std::uint32_t slot = 0; slot < slots; ++slot)
        m_rows[slot] = items[slot].row;
    m_rowCount = static_cast<std::uint32_t>(rows.size());
    m_leafArea = 0.0;
    for (std::uint32_t leaf = 0; leaf < slots / 8; ++leaf)
        fillLeaf(leaf, boxes, kNoLimits, nullptr);
    refitInner();
    m_leafAreaAtBuild = m_leafArea;
    m_reach = slots == 0 ? 0.0f : static_cast<float>(std::sqrt(m_leafArea / (3.0 * (slots / 8))));
}

void BoxTree::layOut(std::uint32_t slots)
{
    m_levelCount = 0;
    std::uint32_t start = 0;
    for (std::uint32_t count = slots / 8; count > 0; count = count == 1 ? 0 : (count + 7) / 8)
    {
        m_levelStart[m_levelCount++] = start;
        start += count;
    }
    m_levelStart[m_levelCount] = start;
    BoxNode empty;
    for (std::uint32_t lane = 0; lane < 8; ++lane)
        setLane(empty, lane, kEmptyAabb);
    m_nodes.assign(start, empty);
    m_rootBounds = kEmptyAabb;
    m_rows.assign(slots, kNoRow);
    for (int level = 0; level < m_levelCount; ++level)
        m_view.levels[level] = m_nodes.data() + m_levelStart[level];
    m_view.levelCount = m_levelCount;
    m_view.rows = m_rows.data();
}

/// @param limits rows whose boxes are not inside leave
/// @param left   [out] rows that left are appended; null when none can
void BoxTree::fillLeaf(std::uint32_t leaf, const Aabb* boxes, const Aabb& limits, std::vector<ProxyId>* left)
{
    BoxNode& lanes = node(0, leaf);
    Aabb bounds = kEmptyAabb;
    for (std::uint32_t lane = 0; lane < 8; ++lane)
    {
        ProxyId& row = m_rows[8 * leaf + lane];
        if (row == kNoRow)
            continue;
        const Aabb& box = boxes[row];
        if (contains(limits, box))
        {
            setLane(lanes, lane, box);
            include(bounds, box);
            continue;
        }
        left->push_back(row);
        row = kNoRow;
        --m_rowCount;
        setLane(lanes, lane, kEmptyAabb);
    }
    m_leafArea += halfArea(bounds);
    setBounds(0, leaf, bounds);
}

Aabb BoxTree::bounds(int level, std::uint32_t index) const noexcept
{
    if (level + 1 == m_levelCount)
        return m_rootBounds;
    return laneBox(m_nodes[m_levelStart[level + 1] + index / 8], index % 8);
}

bool BoxTree::setBounds(int level, std::uint32_t index, const Aabb& box) noexcept
{
    if (level + 1 == m_levelCount)
    {
        m_rootBounds = box;
        return false;
    }
    BoxNode& parent = node(level + 1, index / 8);
    if (laneBox(parent, index % 8) == box)
        return false;
    setLane(parent, index % 8, box);
    return true;
}

/// An empty leaf has limits that contain nothing.
Aabb BoxTree::limitsOf(std::uint32_t leaf) const noexcept
{
    Aabb limits = bounds(0, leaf);
    for (int axis = 0; axis < 3; ++axis)
    {
        const float reach = limits.max[axis] - limits.min[axis] + m_reach;
        limits.min[axis] = std::max(limits.min[axis] - reach, -kTreeReach);
        limits.max[axis] = std::min(limits.max[axis] + reach, kTreeReach);
    }
    return limits;
}

bool BoxTree::fits(std::uint32_t slot, const Aabb& box) const noexcept
{
    return contains(limitsOf(slot / 8), box);
}

void BoxTree::move(std::uint32_t slot, const Aabb& box) noexcept
{
    std::uint32_t index = slot / 8;
    setLane(node(0, index), slot % 8, box);
    m_leafArea -= halfArea(bounds(0, index));
    m_leafArea += halfArea(boundsOfLanes(node(0, index)));
    for (int level = 0; setBounds(level, index, boundsOfLanes(node(level, index))); ++level)
        index /= 8;
}

void BoxTree::remove(std::uint32_t slot) noexcept
{
    m_rows[slot] = kNoRow;
    --m_rowCount;
    move(slot, kEmptyAabb);
}

void BoxTree::refit(const Aabb* boxes, std::vector<ProxyId>& left)
{
    m_leafArea = 0.0;
    for (std::uint32_t leaf = 0; leaf < slotCount() / 8; ++leaf)
        fillLeaf(leaf, boxes, limitsOf(leaf), &left);
    refitInner();
}

void BoxTree::refitInner() noexcept
{
    for (int level = 1; level < m_levelCount; ++level)
    {
        const std::uint32_t count = m_levelStart[level + 1] - m_levelStart[level];
        for (std::uint32_t index = 0; index < count; ++index)
            setBounds(level, index, boundsOfLanes(node(level, index)));
    }
}

std::uint64_t BoxTree::bytes() const noexcept
{
    return m_nodes.capacity() * sizeof(BoxNode) + m_rows.capacity() * sizeof(ProxyId);
}
}  // namespace cullet
