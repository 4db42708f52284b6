// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/render/film/scene_film.h"

#include <functional>
#include <string>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Films a recording (docs/recording-format.md): its boxes, as boxes.
///
/// Boxes that never change are Static, boxes unchanged since the previous frame Asleep, boxes in a pair Near, and the
/// others Separated. A recording has no contacts. Unbounded boxes are skipped.
///
/// @param options steps, every, start (frames of the recording), overlay and world.dt; the rest is ignored
/// @param step    called before each frame with its number; false ends the film early
/// @throws ProgramError (kExitInput) for a file that is missing, truncated or corrupt
Film filmRecording(const std::string& path, const SceneFilmOptions& options,
                   const std::function<bool(int)>& step);
}  // namespace CULLET_PRECISION
}  // namespace cullet
