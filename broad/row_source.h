// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"

#include <cstdint>

namespace cullet
{
/// A ray, or a box swept along a ray, as a segment: the boxes that it may hit overlap [low, high] at some place of it.
struct RayPath
{
    double origin[3];
    double direction[3];
    double length;           ///< in units of the direction
    double low[3], high[3];  ///< the swept box relative to the place, enlarged for Bullet's rounding

    /// The box around a part of the path, from `begin` to `end` in units of the direction.
    Aabb around(double begin, double end) const noexcept;
};

/// Receives rows in batches.
class RowSink
{
public:
    virtual void take(const std::uint32_t* rows, std::uint32_t count) = 0;

protected:
    ~RowSink() = default;
};

/// Second interface of a backend that can name the rows near a ray or a box as of its last update, at no cost for that
/// update.
///
/// Threads: any number of calls at the same time, but none during an update.
class RowSource
{
public:
    virtual ~RowSource() = default;

    /// Hands rows to the sink, among them all whose boxes the ray may hit; a row may come more than once.
    ///
    /// @param boxes of the table, none of which has changed since the last update
    /// @return cost in scanned boxes; 0 if it cannot do so, or not with little work, and then the sink received none
    virtual std::uint32_t findNearRay(const RayPath& ray, const Aabb* boxes, RowSink& sink) const = 0;

    /// The same for the rows whose boxes overlap a box.
    virtual std::uint32_t findNearBox(const Aabb& box, const Aabb* boxes, RowSink& sink) const = 0;
};
}  // namespace cullet
