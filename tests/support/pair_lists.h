// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/pair.h"
#include "cullet/broad/row_pair.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace cullet::test
{
/// Pairs of rows in order, the lower row first, to compare lists of different algorithms.
inline Pairs inOrder(const std::vector<RowPair>& rows)
{
    Pairs pairs;
    for (const RowPair pair : rows)
        pairs.push_back(makePair(pair.a, pair.b));
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

/// Every pair of valid boxes that overlap, in order. O(n^2)
inline Pairs everyPair(const std::vector<Aabb>& boxes)
{
    Pairs pairs;
    for (std::uint32_t a = 0; a < boxes.size(); ++a)
    {
        for (std::uint32_t b = a + 1; b < boxes.size(); ++b)
        {
            if (isValid(boxes[a]) && isValid(boxes[b]) && overlaps(boxes[a], boxes[b]))
                pairs.push_back({a, b});
        }
    }
    return pairs;
}
}  // namespace cullet::test
