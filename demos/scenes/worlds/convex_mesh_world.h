// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/bodies/world_scene.h"

#include <memory>
#include <string>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Scene "convex-mesh": what the scene ConvexVsMesh of the Jolt library's PerformanceTest measures. 1,764 bodies, a quarter each boxes,
/// spheres, capsules and hulls of five points, fall onto hills of 20,000 triangles with edges of 3 m. Friction 0.5 and
/// restitution 0.6 of all bodies, damping 0.05, gravity -9.81, masses of 1,000 kg/m^3.
///
/// Bullet multiplies the friction and the restitution of two bodies; Jolt takes the root of the product and the larger
/// one.
std::unique_ptr<WorldScene> makeConvexMeshScene(const std::string& name, NamedBroadphase broadphase,
                                                const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
