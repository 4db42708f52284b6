// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/queries/bvh.h"

#include <algorithm>
#include <cmath>

namespace cullet
{
namespace
{
/// Boxes whose sizes share these octaves share leaves. Measured on sizes over three decades: with one octave queries
/// cost up to twice as much, with four no more than with none; without classes a few huge boxes enlarge every node
/// above small ones.
constexpr int kOctavesPerClass = 4;

struct Item
{
    float centre[3];
    ProxyId row;
};

struct Extent
{
    float min[3] = {INFINITY, INFINITY, INFINITY};
    float max[3] = {-INFINITY, -INFINITY, -INFINITY};

    void include(const float* point) noexcept
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            min[axis] = std::min(min[axis], point[axis]);
            max[axis] = std::max(max[axis], point[axis]);
        }
    }
};

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

/// The axis along which the centres spread most; -1 when they are all one point.
int widestAxis(const Item* begin, const Item* end) noexcept
{
    // Two accumulators per bound: the latency of the chain of minima limits this loop.
    Extent even;
    Extent odd;
    const Item* item = begin;
    for (; end - item >= 2; item += 2)
    {
        even.include(item[0].centre);
        odd.include(item[1].centre);
    }
    if (item != end)
        even.include(item->centre);
    float size[3];
    for (int axis = 0; axis < 3; ++axis)
        size[axis] = std::max(even.max[axis], odd.max[axis]) - std::min(even.min[axis], odd.min[axis]);
    const int widest = static_cast<int>(std::max_element(size, size + 3) - size);
    return size[widest] > 0.0f ? widest : -1;
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

/// std::nth_element by one coordinate: quickselect, and after too many rounds the standard function, for its bound.
void selectByAxis(Item* begin, Item* nth, Item* end, int axis) noexcept
{
    for (int round = 0; end - begin > 8 && round < 40; ++round)
    {
        const float pivot = pivotOf(begin, end, axis);
        Item* low = partition(begin, end, [=](const Item& item) { return item.centre[axis] < pivot; });
        if (low == begin)
        {
            // The pivot is the lowest key: all equal keys are moved at once, however many there are.
            low = partition(begin, end, [=](const Item& item) { return item.centre[axis] <= pivot; });
            if (nth < low)
                return;
        }
        (nth < low ? end : begin) = low;
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

/// Slots of the boxes of each class.
struct ClassRanges
{
    int group[kSizeClasses];                // the range that a class belongs to
    std::uint32_t begin[kSizeClasses + 1];  // by group; a multiple of 8, so that groups share no leaf
    std::uint32_t end[kSizeClasses + 1];
    int groupCount = 0;
    std::uint32_t slots = 0;
};

/// Merges classes with too few boxes for a few leaves into the next larger class.
ClassRanges rangesOfClasses(const Aabb* boxes, const std::vector<ProxyId>& rows)
{
    constexpr std::uint32_t kFewest = 64;
    std::uint32_t counts[kSizeClasses] = {};
    for (const ProxyId row : rows)
        ++counts[sizeClass(boxes[row])];
    ClassRanges ranges;
    std::uint32_t held = 0;
    for (int c = 0; c < kSizeClasses; ++c)
    {
        ranges.group[c] = ranges.groupCount;
        held += counts[c];
        if (held < kFewest && c + 1 < kSizeClasses)
            continue;
        ranges.begin[ranges.groupCount] = ranges.slots;
        ranges.end[ranges.groupCount] = ranges.slots + held;
        ranges.slots = (ranges.slots + held + 7) / 8 * 8;
        ++ranges.groupCount;
        held = 0;
    }
    return ranges;
}

std::vector<Item> itemsByClass(const Aabb* boxes, const std::vector<ProxyId>& rows, const ClassRanges& ranges)
{
    std::vector<Item> items(ranges.slots, Item{{0.0f, 0.0f, 0.0f}, kNoRow});
    std::uint32_t next[kSizeClasses];
    std::copy(ranges.begin, ranges.begin + ranges.groupCount, next);
    for (const ProxyId row : rows)
    {
        const Aabb& box = boxes[row];
        Item& item = items[next[ranges.group[sizeClass(box)]]++];
        item.row = row;
        for (int axis = 0; axis < 3; ++axis)
            item.centre[axis] = 0.5f * box.min[axis] + 0.5f * box.max[axis];
    }
    return items;
}
}  // namespace

/// Prefetches the boxes of a later leaf: neighbours in space are far apart in the table. Inlined, since GCC drops calls
/// that do nothing but prefetch.
[[gnu::always_inline]] inline void Bvh::prefetch(std::uint32_t leaf, const Aabb* boxes) const noexcept
{
    constexpr std::uint32_t kAhead = 32;  // slots
    for (std::uint32_t slot = 8 * leaf + kAhead; slot < std::min(8 * leaf + kAhead + 8, slotCount()); ++slot)
    {
        if (m_rows[slot] != kNoRow)
            __builtin_prefetch(boxes + m_rows[slot]);
    }
}

void Bvh::build(const Aabb* boxes, const std::vector<ProxyId>& rows)
{
    const ClassRanges ranges = rangesOfClasses(boxes, rows);
    std::vector<Item> items = itemsByClass(boxes, rows, ranges);
    layOut(ranges.slots);
    // Slots under one node of the topmost level that may branch; 8^10 is the last power that 32 bits hold.
    std::uint32_t capacity = 8;
    while (capacity < ranges.slots && capacity < 0x40000000u)
        capacity *= 8;
    for (int group = 0; group < ranges.groupCount; ++group)
    {
        const std::uint32_t begin = ranges.begin[group];
        if (ranges.end[group] > begin)
            orderByMedians(items.data() + begin, begin, ranges.end[group], capacity);
    }
    for (std::uint32_t slot = 0; slot < ranges.slots; ++slot)
        m_rows[slot] = items[slot].row;
    m_rowCount = static_cast<std::uint32_t>(rows.size());
    m_leafArea = 0.0;
    for (std::uint32_t leaf = 0; leaf < ranges.slots / 8; ++leaf)
    {
        Aabb around;
        prefetch(leaf, boxes);
        fillLanes(leaf, boxes, around);
        closeLeaf(leaf, around);
    }
    refitInner();
    m_leafAreaAtBuild = m_leafArea;
    m_meanLeafSize =
        ranges.slots == 0 ? 0.0f : static_cast<float>(std::sqrt(m_leafArea / (3.0 * (ranges.slots / 8))));
}

void Bvh::layOut(std::uint32_t slots)
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

/// Reads the boxes of a leaf's rows into its lanes; returns true if all of its rows have valid boxes.
bool Bvh::fillLanes(std::uint32_t leaf, const Aabb* boxes, Aabb& around)
{
    const Aabb* lanes[8];
    std::uint32_t held = 0;
    for (std::uint32_t lane = 0; lane < 8; ++lane)
    {
        const ProxyId row = m_rows[8 * leaf + lane];
        lanes[lane] = row == kNoRow ? &kEmptyAabb : boxes + row;
        held |= (row == kNoRow ? 0u : 1u) << lane;
    }
    return m_kernels.fillNode(lanes, node(0, leaf), around) == held;
}

void Bvh::closeLeaf(std::uint32_t leaf, const Aabb& around) noexcept
{
    m_leafArea += halfArea(around);
    setBounds(0, leaf, around);
}

/// Removes the rows whose boxes do not fit from a leaf.
void Bvh::removeUnfitRows(std::uint32_t leaf, const Aabb* boxes, std::vector<ProxyId>& left)
{
    const Aabb limits = limitsOf(leaf);
    for (std::uint32_t slot = 8 * leaf; slot < 8 * leaf + 8; ++slot)
    {
        ProxyId& row = m_rows[slot];
        if (row == kNoRow || contains(limits, boxes[row]))
            continue;
        left.push_back(row);
        row = kNoRow;
        --m_rowCount;
    }
}

Aabb Bvh::bounds(int level, std::uint32_t index) const noexcept
{
    if (level + 1 == m_levelCount)
        return m_rootBounds;
    return laneBox(m_nodes[m_levelStart[level + 1] + index / 8], index % 8);
}

bool Bvh::setBounds(int level, std::uint32_t index, const Aabb& box) noexcept
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
Aabb Bvh::limitsOf(std::uint32_t leaf) const noexcept
{
    Aabb limits = bounds(0, leaf);
    for (int axis = 0; axis < 3; ++axis)
    {
        const float allowance = limits.max[axis] - limits.min[axis] + m_meanLeafSize;
        limits.min[axis] = std::max(limits.min[axis] - allowance, -kMaxTreeCoordinate);
        limits.max[axis] = std::min(limits.max[axis] + allowance, kMaxTreeCoordinate);
    }
    return limits;
}

bool Bvh::fits(std::uint32_t slot, const Aabb& box) const noexcept
{
    return contains(limitsOf(slot / 8), box);
}

bool Bvh::holds(std::uint32_t slot, const Aabb& box) const noexcept
{
    const Aabb stored = laneBox(m_nodes[slot / 8], slot % 8);
    bool isFilled = true;
    for (int axis = 0; axis < 3; ++axis)
        isFilled &= stored.max[axis] - stored.min[axis] <= 2.0f * (box.max[axis] - box.min[axis]);
    return isFilled && contains(stored, box);
}

void Bvh::move(std::uint32_t slot, const Aabb& box) noexcept
{
    std::uint32_t index = slot / 8;
    setLane(node(0, index), slot % 8, box);
    m_leafArea -= halfArea(bounds(0, index));
    m_leafArea += halfArea(boundsOfLanes(node(0, index)));
    for (int level = 0; setBounds(level, index, boundsOfLanes(node(level, index))); ++level)
        index /= 8;
}

void Bvh::remove(std::uint32_t slot) noexcept
{
    m_rows[slot] = kNoRow;
    --m_rowCount;
    move(slot, kEmptyAabb);
}

void Bvh::refit(const Aabb* boxes, std::vector<ProxyId>& left)
{
    m_leafArea = 0.0;
    for (std::uint32_t leaf = 0; leaf < slotCount() / 8; ++leaf)
    {
        prefetch(leaf, boxes);
        Aabb around;
        // Nearly always the leaf fits as a whole, and with it each of its rows.
        if (!fillLanes(leaf, boxes, around) || !contains(limitsOf(leaf), around))
        {
            removeUnfitRows(leaf, boxes, left);
            fillLanes(leaf, boxes, around);
        }
        closeLeaf(leaf, around);
    }
    refitInner();
}

void Bvh::refitInner() noexcept
{
    for (int level = 1; level < m_levelCount; ++level)
    {
        const std::uint32_t count = m_levelStart[level + 1] - m_levelStart[level];
        for (std::uint32_t index = 0; index < count; ++index)
            setBounds(level, index, boundsOfLanes(node(level, index)));
    }
}

std::uint64_t Bvh::bytes() const noexcept
{
    return m_nodes.capacity() * sizeof(BoxNode) + m_rows.capacity() * sizeof(ProxyId);
}
}  // namespace cullet
