// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/narrow/hull_set.h"

#include <cstdint>

namespace cullet
{
/// Hulls of points on a sphere of radius 1, the same in every run. For programs whose sources nvcc compiles, which are
/// kept free of Eigen.
HullSet hullsOnSphere(std::uint32_t hulls, int points);
}  // namespace cullet
