// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cstdint>

/// A merged face whose corners rounding has moved off their plane: its triangles are faces of the hull, too, and which of
/// them a search ends at depends on where it began.
namespace cullet
{
/// Twice the area times the normal of a polygon in space, counter-clockwise around it.
///
/// @param point returns a corner, from 0 on
template <class PointOf>
Eigen::Vector3d areaNormal(std::int32_t count, const PointOf& point)
{
    const Eigen::Vector3d first = point(0);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), last = point(1) - first;
    for (std::int32_t i = 2; i < count; ++i)
    {
        const Eigen::Vector3d next = point(i) - first;
        sum += last.cross(next);
        last = next;
    }
    return sum;
}

/// The triangle of a bent face that is highest over a place: from the fan of the first corner, the highest corner replaces
/// one of the triangle's until none is higher.
///
/// @param point  returns a corner, from 0 on
/// @param normal of the face, see areaNormal()
/// @param level  a corner is not higher if it is by less than this
/// @param three  [out] counter-clockwise
/// @return false if there is no end
/// Cost: a few products for each corner and step; mostly one step or two.
template <class PointOf>
bool findHighestTriangle(std::int32_t count, const PointOf& point, const Eigen::Vector3d& normal,
                         const Eigen::Vector3d& place, double level, std::array<std::int32_t, 3>& three)
{
    const auto isLeftOf = [&](std::int32_t from, std::int32_t to)
    { return normal.dot((point(to) - point(from)).cross(place - point(from))) > 0.0; };
    three = {0, 1, 2};
    while (three[2] + 1 < count && isLeftOf(0, three[2]))
        three = {0, three[2], three[2] + 1};
    for (std::int32_t step = 0; step < count; ++step)
    {
        const Eigen::Vector3d from = point(three[0]);
        const Eigen::Vector3d up = (point(three[1]) - from).cross(point(three[2]) - from).normalized();
        std::int32_t highest = -1;
        double height = level;
        for (std::int32_t i = 0; i < count; ++i)
        {
            const double rise = up.dot(point(i) - from);
            highest = rise > height ? i : highest;
            height = rise > height ? rise : height;
        }
        if (highest < 0)
            return true;
        int k = 0;
        while (k < 2 && !(isLeftOf(highest, three[k]) && !isLeftOf(highest, three[(k + 1) % 3])))
            ++k;
        three = {highest, three[k], three[(k + 1) % 3]};
    }
    return false;
}
}  // namespace cullet
