// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Replaces device_triangles.cpp in a build without CUDA.

#include "cullet/demos/figures/midphase/triangle_motion.h"

namespace cullet
{
TriangleTimes timeDeviceTrees(const TriangleMotion&, bool)
{
    return {};
}
}  // namespace cullet
