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
/// Scene "file": the rigid bodies and constraints of options.file, a `.bullet` file as btDefaultSerializer writes it, in
/// either precision. Its bodies keep the default filter.
///
/// Bullet's importer reads the file and trusts it; files from strangers are not for it.
///
/// @throws ProgramError: kExitInput for a file that is missing or none, kExitUsage without options.file,
///         kExitUnavailable when this program was built without Bullet's extras
std::unique_ptr<WorldScene> makeFileScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
