// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"

#include <cstdint>
#include <functional>

namespace cullet
{
/// Receives a cell and its level, 0 for the finest; the box is infinite along an axis that is not divided.
using CellVisitor = std::function<void(const Aabb& cell, std::uint32_t level)>;

/// Second interface of a backend that has cells, for drawing them.
class CellSource
{
public:
    virtual ~CellSource() = default;

    /// Calls visit for every cell in use as of the last update, in no particular order; a box lies in the union of the
    /// cells that store it. Awake boxes among resting ones may have a grid of their own. There are no cells while there
    /// is no grid: before the first update, or because there are few boxes. O(cells).
    virtual void forEachCell(const CellVisitor& visit) const = 0;
};
}  // namespace cullet
