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
/// A btSoftRigidDynamicsWorld with its configuration.
const WorldKind& softWorldKind();

/// Scene "soft": soft balls of radius 0.5 with about 100 nodes, and as many rigid cubes of 0.7, fall from layers 1.5
/// apart into a walled square; a btSoftRigidDynamicsWorld.
std::unique_ptr<WorldScene> makeSoftScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
