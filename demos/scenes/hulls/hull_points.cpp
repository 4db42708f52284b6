// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_points.h"

namespace cullet
{
template Hull<float> makeHull(const std::vector<Eigen::Vector3f>&, HullExtra);
template Hull<double> makeHull(const std::vector<Eigen::Vector3d>&, HullExtra);
template Hull<float> makeHull(const Eigen::Vector3f*, std::int32_t, HullExtra);
template Hull<double> makeHull(const Eigen::Vector3d*, std::int32_t, HullExtra);
template Hull<float> makeCornerHull(const std::vector<Eigen::Vector3f>&);
template Hull<double> makeCornerHull(const std::vector<Eigen::Vector3d>&);
}  // namespace cullet
