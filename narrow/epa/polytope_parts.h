// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>

namespace cullet
{
/// Types that polytopes of all capacities share.
struct PolytopeParts
{
    using Corners = std::array<std::int16_t, 3>;

    struct Face
    {
        Eigen::Vector3d scaledNormal;  ///< outward
        double length;                 ///< of the scaled normal
        double distance;               ///< of its plane from the origin; at least 0 up to rounding
        Corners vertex;
        int index;  ///< among the faces; valid until the polytope changes
    };

    /// Without a branch for each corner.
    static bool hasCorner(const Corners& c, std::int16_t vertex)
    {
        return (int{c[0] == vertex} | int{c[1] == vertex} | int{c[2] == vertex}) != 0;
    }

    struct Foot
    {
        Corners vertex;
        Eigen::Vector3d weights;  ///< of the corners: not negative, sum 1
        double miss;              ///< distance between the weighted point and the foot of the plane
    };
};
}  // namespace cullet
