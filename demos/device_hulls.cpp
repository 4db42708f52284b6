// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/device_hulls.h"

#include "cullet/narrow/build/hull_builder.h"

#include <Eigen/Core>

#include <random>
#include <vector>

namespace cullet
{
HullSet hullsOnSphere(std::uint32_t hulls, int points)
{
    std::mt19937 engine(44);
    std::normal_distribution<float> normal;
    HullSet set;
    for (std::uint32_t hull = 0; hull < hulls; ++hull)
    {
        std::vector<Eigen::Vector3f> corners;
        for (int i = 0; i < points; ++i)
        {
            Eigen::Vector3f corner;
            for (int axis = 0; axis < 3; ++axis)
                corner[axis] = normal(engine);
            corners.push_back(corner.normalized());
        }
        set.add(makeHull(corners));
    }
    return set;
}
}  // namespace cullet
