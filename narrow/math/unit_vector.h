// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace cullet
{
/// The direction of a vector of any length. Zero stays zero, without the division by zero in Eigen's function.
inline Eigen::Vector3d unitOf(const Eigen::Vector3d& v)
{
    if (v.isZero(0.0))
        return v;
    return v.stableNormalized();
}
}  // namespace cullet
