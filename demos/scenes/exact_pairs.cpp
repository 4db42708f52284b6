// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/exact_pairs.h"

#include <algorithm>

namespace cullet
{
namespace
{
bool isValidBox(const ExactBox& box) noexcept
{
    return box.min[0] <= box.max[0] && box.min[1] <= box.max[1] && box.min[2] <= box.max[2];
}
}  // namespace

ExactBox toExactBox(const Aabb& box) noexcept
{
    return {{box.min[0], box.min[1], box.min[2]}, {box.max[0], box.max[1], box.max[2]}};
}

Pairs findExactPairs(const std::vector<ExactBox>& boxes)
{
    struct Entry
    {
        ExactBox box;
        std::uint32_t row;
    };
    std::vector<Entry> entries;
    for (std::uint32_t row = 0; row < boxes.size(); ++row)
    {
        if (isValidBox(boxes[row]))
            entries.push_back({boxes[row], row});
    }
    std::sort(entries.begin(), entries.end(),
              [](const Entry& a, const Entry& b) { return a.box.min[0] < b.box.min[0]; });
    Pairs pairs;
    for (std::size_t i = 0; i < entries.size(); ++i)
    {
        const double end = entries[i].box.max[0];
        for (std::size_t j = i + 1; j < entries.size() && entries[j].box.min[0] <= end; ++j)
        {
            if (overlaps(entries[i].box, entries[j].box))
                pairs.push_back(makePair(entries[i].row, entries[j].row));
        }
    }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}
}  // namespace cullet
