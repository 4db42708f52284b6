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
/// Static are boxes that never change, asleep those that have not changed since the frame before; near those in a pair,
/// and separated the others. What touches is not in a recording. Boxes without end are left out.
///
/// @param options steps, every, start (frames of the recording), overlay and world.dt; the rest is not read
/// @param step    called before each frame with its number; false ends the film early
/// @throws ProgramError (kExitInput) for a file that is missing, truncated or corrupt
Film filmRecording(const std::string& path, const SceneFilmOptions& options,
                   const std::function<bool(int)>& step);
}  // namespace CULLET_PRECISION
}  // namespace cullet
