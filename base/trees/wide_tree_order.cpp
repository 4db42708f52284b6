// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/base/trees/wide_tree_order.h"

#include "cullet/base/threads/parallel_loops.h"

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <optional>

namespace cullet
{
namespace
{
/// Boxes whose sizes share these octaves share leaves. Measured on sizes over three decades: with one octave queries
/// cost up to twice as much, with four no more than with none; without classes a few huge boxes enlarge every node
/// above small ones.
constexpr int kOctavesPerClass = 4;
constexpr int kSizeClasses = 256 / kOctavesPerClass;

struct Item
{
    float centre[3];
    std::uint32_t id;
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

/// Slots [begin, end) whose items are to be ordered so that every node of a complete tree holds neighbours.
struct SlotRange
{
    std::uint32_t begin;
    std::uint32_t end;
    std::uint32_t
        capacity;  ///< slots under one child at the present level; a range crosses no node of eight times that
};

/// Separates the items of a range by a median, makes the range that of the lower ones and returns that of the others.
/// Without a result the range is ordered.
std::optional<SlotRange> split(Item* items, SlotRange& range)
{
    for (; range.capacity >= 8; range.capacity /= 8)
    {
        const std::uint32_t first = range.begin / range.capacity;
        const std::uint32_t last = (range.end - 1) / range.capacity;
        if (first == last)
            continue;
        const std::uint32_t middle = (first + (last - first + 1) / 2) * range.capacity;
        const int axis = widestAxis(items + range.begin, items + range.end);
        if (axis < 0)
            return std::nullopt;
        selectByAxis(items + range.begin, items + middle, items + range.end, axis);
        const SlotRange upper = {middle, range.end, range.capacity};
        range.end = middle;
        return upper;
    }
    return std::nullopt;
}

void orderByMedians(Item* items, SlotRange range)
{
    while (const std::optional<SlotRange> upper = split(items, range))
    {
        orderByMedians(items, range);
        range = *upper;
    }
}

/// Orders ranges on several threads: all of them are split, in rounds, until there are enough for each thread.
void orderByMedians(Item* items, std::vector<SlotRange> ranges, ParallelLoops& loops)
{
    const std::size_t enough = std::size_t(8) * loops.threads();
    while (!ranges.empty() && ranges.size() < enough)
    {
        std::vector<std::optional<SlotRange>> upper(ranges.size());
        loops.run(static_cast<unsigned>(ranges.size()),
                  [&](unsigned task) { upper[task] = split(items, ranges[task]); });
        std::vector<SlotRange> next;
        for (std::size_t i = 0; i < ranges.size(); ++i)
        {
            if (!upper[i])
                continue;
            next.push_back(ranges[i]);
            next.push_back(*upper[i]);
        }
        ranges.swap(next);
    }
    loops.run(static_cast<unsigned>(ranges.size()),
              [&](unsigned task) { orderByMedians(items, ranges[task]); });
}

/// Class of a box: the order of magnitude of its largest side; all tiny boxes share class 0.
int sizeClass(const float* planes) noexcept
{
    const float size =
        std::max({planes[3] - planes[0], planes[4] - planes[1], planes[5] - planes[2], 1e-30f});
    return (std::ilogb(std::min(size, FLT_MAX)) + 100) / kOctavesPerClass;
}

using ClassCounts = std::array<std::uint32_t, kSizeClasses>;

/// Slots of the boxes of each class.
struct ClassRanges
{
    int group[kSizeClasses];            // the range that a class belongs to
    std::uint32_t begin[kSizeClasses];  // by group; a multiple of 8, so that groups share no leaf
    std::uint32_t end[kSizeClasses];
    int groupCount = 0;
    std::uint32_t slots = 0;
};

/// Merges classes with too few boxes for a few leaves into the next larger class.
ClassRanges rangesOfClasses(const ClassCounts& counts)
{
    constexpr std::uint32_t kFewest = 64;
    ClassRanges ranges;
    std::uint32_t held = 0;
    for (int c = 0; c < kSizeClasses; ++c)
    {
        ranges.group[c] = ranges.groupCount;
        held += counts[static_cast<std::size_t>(c)];
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

/// Puts the boxes into the slots of their groups, in the order in which they are given.
class SlotItems
{
public:
    SlotItems(const BoxesToOrder& boxes, ParallelLoops& loops)
        : m_boxes(boxes), m_loops(loops), m_counts(loops.tasksFor(boxes.count, 16384))
    {
        forEachTask([this](unsigned task, std::uint32_t, std::uint32_t id)
                    { ++m_counts[task][classOf(id)]; });
        ClassCounts total = {};
        for (const ClassCounts& counts : m_counts)
        {
            for (std::size_t c = 0; c < total.size(); ++c)
                total[c] += counts[c];
        }
        ranges = rangesOfClasses(total);
    }

    std::vector<Item> make()
    {
        std::vector<Item> items(ranges.slots, Item{{0.0f, 0.0f, 0.0f}, kEmptySlot});
        turnCountsIntoPlaces();
        forEachTask(
            [&](unsigned task, std::uint32_t, std::uint32_t id)
            {
                Item& item = items[m_counts[task][groupOf(id)]++];
                item.id = id;
                const float* planes = m_boxes.planes[id];
                for (int axis = 0; axis < 3; ++axis)
                    item.centre[axis] = 0.5f * planes[axis] + 0.5f * planes[axis + 3];
            });
        return items;
    }

    ClassRanges ranges;

private:
    std::size_t classOf(std::uint32_t id) const
    {
        return static_cast<std::size_t>(sizeClass(m_boxes.planes[id]));
    }
    std::size_t groupOf(std::uint32_t id) const
    {
        return static_cast<std::size_t>(ranges.group[classOf(id)]);
    }

    template <class Body>
    void forEachTask(const Body& body)
    {
        const auto tasks = static_cast<unsigned>(m_counts.size());
        m_loops.run(tasks,
                    [&](unsigned task)
                    {
                        const TaskRange range(m_boxes.count, task, tasks);
                        for (std::uint32_t i = range.begin; i < range.end; ++i)
                            body(task, i, m_boxes.ids == nullptr ? i : m_boxes.ids[i]);
                    });
    }

    /// From then on, [task][group] is where the task's next box of the group belongs.
    void turnCountsIntoPlaces()
    {
        std::array<std::uint32_t, kSizeClasses> next;
        std::copy(ranges.begin, ranges.begin + ranges.groupCount, next.begin());
        for (ClassCounts& counts : m_counts)
        {
            ClassCounts places = {};
            for (std::size_t c = 0; c < counts.size(); ++c)
                places[static_cast<std::size_t>(ranges.group[c])] += counts[c];
            for (std::size_t group = 0; group < static_cast<std::size_t>(ranges.groupCount); ++group)
            {
                const std::uint32_t size = places[group];
                places[group] = next[group];
                next[group] += size;
            }
            counts = places;
        }
    }

    const BoxesToOrder& m_boxes;
    ParallelLoops& m_loops;
    std::vector<ClassCounts> m_counts;  ///< by task
};
}  // namespace

std::vector<std::uint32_t> wideTreeOrder(const BoxesToOrder& boxes, ParallelLoops* loops)
{
    ParallelLoops one(1);
    ParallelLoops& used = loops != nullptr ? *loops : one;
    SlotItems slots(boxes, used);
    std::vector<Item> items = slots.make();
    const ClassRanges& ranges = slots.ranges;
    // Slots under one node of the topmost level that may branch; 8^10 is the last power that 32 bits hold.
    std::uint32_t capacity = 8;
    while (capacity < ranges.slots && capacity < 0x40000000u)
        capacity *= 8;
    std::vector<SlotRange> groups;
    for (int group = 0; group < ranges.groupCount; ++group)
    {
        if (ranges.end[group] > ranges.begin[group])
            groups.push_back({ranges.begin[group], ranges.end[group], capacity});
    }
    orderByMedians(items.data(), std::move(groups), used);
    std::vector<std::uint32_t> ids(ranges.slots);
    const unsigned tasks = used.tasksFor(ids.size(), 65536);
    used.run(tasks,
             [&](unsigned task)
             {
                 const TaskRange range(ids.size(), task, tasks);
                 for (std::uint32_t slot = range.begin; slot < range.end; ++slot)
                     ids[slot] = items[slot].id;
             });
    return ids;
}
}  // namespace cullet
