// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/render/film/film.h"
#include "cullet/demos/scenes/bodies/world_scene.h"
#include "cullet/plugin/core/debug_draw_options.h"

#include <functional>
#include <string>

namespace cullet
{
inline namespace CULLET_PRECISION
{
struct SceneFilmOptions
{
    std::string scene;
    WorldSceneOptions world;
    int steps = 240;
    int every = 2;                              ///< steps between two frames
    int start = 0;                              ///< steps before the first frame
    DebugDrawOptions overlay = nothingDrawn();  ///< needs one of cullet's broad phases
    TraceFile* trace = nullptr;                 ///< receives the phases of every step

    static DebugDrawOptions nothingDrawn();
};

/// Steps a scene and films it: frames after `start` steps, and after each further `every`.
///
/// @param step called before each step with its number; false ends the film early
/// @throws as makeWorldScene()
Film filmScene(const SceneFilmOptions& options, const std::function<bool(int)>& step);
}  // namespace CULLET_PRECISION
}  // namespace cullet
