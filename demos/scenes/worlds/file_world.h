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
/// Scene "file": the rigid bodies and constraints of options.file, a `.bullet` file as btDefaultSerializer writes it,
/// in either precision. Its bodies keep the default filter.
///
/// Bullet's importer trusts the file: do not read files from untrusted sources.
///
/// @throws ProgramError: kExitInput for a missing or invalid file, kExitUsage without options.file, kExitUnavailable
///         when this program was built without Bullet's extras
std::unique_ptr<WorldScene> makeFileScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
