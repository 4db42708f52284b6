// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/figures/figure.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The part of `figure midphase` for meshes that deform: milliseconds from the vertices of two sheets to the pairs of their
/// triangles against the number of triangles. wide: the CPU's tree of eight boxes a node, built in each frame; linear, linear-refit:
/// LinearBvh on the CPU; device, device-refit: DeviceTriangleTrees, where a device answers. One thread of the CPU.
void measureTriangleSizes(const FigureOptions& options, ResultFile& file);
}  // namespace CULLET_PRECISION
}  // namespace cullet
