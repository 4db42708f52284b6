// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/program/precision.h"
#include "cullet/demos/scenes/bodies/world_scene.h"

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

// The options of subcommands that step a scene of bodies: run, bench world, record, render.
namespace cullet
{
struct SceneArguments
{
    std::string scene = "drop";
    WorldSceneOptions world;
    double dt = 1.0 / 60.0;
    std::vector<std::string> meshes;
    std::string precision = ownPrecision();
};

/// Adds --scene, --bodies, --seed, --dt, --mesh, --file and --precision.
void addSceneArguments(CLI::App& command, SceneArguments& arguments);

/// Adds --threads, one number.
void addThreadsArgument(CLI::App& command, SceneArguments& arguments);

/// Adds --backend and --narrow, one of each.
void addPhaseArguments(CLI::App& command, SceneArguments& arguments);

/// The options of makeWorldScene(): reads the meshes and prints a line for each.
///
/// @throws std::invalid_argument for an unknown scene, listing the known ones; ProgramError (kExitInput) for a mesh
///         that cannot be read
WorldSceneOptions resolveScene(const SceneArguments& arguments);
}  // namespace cullet
