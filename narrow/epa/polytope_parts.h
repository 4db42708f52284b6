// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>

namespace cullet
{
/// What polytopes of all capacities have in common.
struct PolytopeParts
{
    using Corners = std::array<std::int16_t, 3>;

    struct Face
    {
        Eigen::Vector3d scaledNormal;  ///< outward
        double length;                 ///< of the scaled normal
        double distance;               ///< of its plane from the origin; at least 0 up to rounding
        Corners vertex;
        int index;  ///< among the faces, until the next one changes
    };

    struct Foot
    {
        Corners vertex;
        Eigen::Vector3d weights;  ///< of the corners: not negative, sum 1
        double miss;              ///< distance of the point that they make from where it should be
    };
};
}  // namespace cullet
