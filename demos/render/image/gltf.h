// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/render/film/film.h"

#include <string>

namespace cullet
{
/// Throws std::invalid_argument unless the file ends in .gltf.
void checkGltf(const std::string& path);

/// Writes a film as glTF 2.0: FILE.gltf (JSON) and FILE.bin beside it, for any viewer, Blender or a browser.
///
/// A node for each body and mesh; bodies that move have an animation of translation and rotation with a key at each
/// frame, linear in between. Bodies that appear or disappear, and the frames of a soft body, are shown by steps of the
/// scale. glTF has no animated materials, so a body has the colour of its last state. Lines of boxes, cells and pairs
/// are not written.
///
/// @throws as checkGltf(); ProgramError (kExitOutput) if a file cannot be written
void writeGltf(const Film& film, const std::string& path);
}  // namespace cullet
