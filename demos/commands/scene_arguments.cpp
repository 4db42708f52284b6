// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/commands/scene_arguments.h"

#include "cullet/demos/commands/argument_checks.h"
#include "cullet/demos/commands/commands.h"
#include "cullet/demos/program/exit_code.h"

#include <cstdio>
#include <filesystem>

namespace cullet
{
namespace
{
/// The installed meshes of Debian's package glmark2-data.
std::vector<std::string> findDefaultMeshes()
{
    std::vector<std::string> found;
    for (const char* name : {"bunny.obj", "horse.3ds", "cat.3ds", "asteroid-low.3ds", "asteroid-high.3ds"})
    {
        const std::string path = std::string("/usr/share/glmark2/models/") + name;
        if (std::filesystem::exists(path))
            found.push_back(path);
    }
    if (found.empty())
        std::puts(
            "note: no meshes in /usr/share/glmark2/models (package glmark2-data), boxes and spheres only; "
            "name meshes with --mesh FILE...");
    return found;
}

std::vector<HullPoints> loadHulls(const std::vector<std::string>& paths)
{
    std::vector<HullPoints> hulls;
    for (const std::string& path : paths)
    {
        try
        {
            hulls.push_back(loadMeshHull(path));
        }
        catch (const MeshError& error)
        {
            throw ProgramError(kExitInput, error.what());
        }
        std::printf("mesh %s: %zu vertices, hull of %zu\n", hulls.back().name.c_str(),
                    hulls.back().meshVertices, hulls.back().points.size());
    }
    return hulls;
}
}  // namespace

void addSceneArguments(CLI::App& command, SceneArguments& arguments)
{
    WorldSceneOptions& world = arguments.world;
    command.add_option("--scene", arguments.scene, "'cullet list' prints the scenes of bodies")
        ->capture_default_str();
    command.add_option("--bodies", world.bodies, "bodies in the world; default: the scene's own number")
        ->check(CLI::Range(1, 10000000));
    command.add_option("--seed", world.seed, "of places, rotations and shapes")
        ->capture_default_str()
        ->check(notNegative());
    command.add_option("--dt", arguments.dt, "length of a step, seconds")
        ->capture_default_str()
        ->check(numberIn(1e-6, 1.0));
    command.add_option("--mesh", arguments.meshes,
                       "mesh files whose convex hulls fall (scene drop); default: glmark2's models");
    command.add_option("--file", world.file, "the .bullet file of scene 'file'");
    command.add_option("--precision", arguments.precision, "of Bullet")
        ->capture_default_str()
        ->check(CLI::IsMember({"float", "double"}));
}

void addThreadsArgument(CLI::App& command, SceneArguments& arguments)
{
    command.add_option("--threads", arguments.world.threads, "of the CPU backends; 0: all cores")
        ->capture_default_str()
        ->check(CLI::Range(0, 4096));
}

void addPhaseArguments(CLI::App& command, SceneArguments& arguments)
{
    command.add_option("--backend", arguments.world.backend, "broad phase ('cullet list')")
        ->capture_default_str();
    command.add_option("--narrow", arguments.world.narrow, "narrow phase")
        ->capture_default_str()
        ->check(CLI::IsMember(narrowPhaseNames()));
}

WorldSceneOptions resolveScene(const SceneArguments& arguments)
{
    WorldSceneOptions options = arguments.world;
    options.dt = btScalar(arguments.dt);
    const WorldSceneInfo& scene = requireWorldScene(arguments.scene);
    if (options.bodies == 0)
        options.bodies = scene.bodies;
    if (scene.takesMeshes)
        options.hulls = loadHulls(arguments.meshes.empty() ? findDefaultMeshes() : arguments.meshes);
    else if (!arguments.meshes.empty())
        throw ProgramError(kExitUsage, "scene '" + arguments.scene + "' takes no --mesh");
    if (!options.file.empty() && arguments.scene != "file")
        throw ProgramError(kExitUsage, "scene '" + arguments.scene + "' takes no --file");
    return options;
}
}  // namespace cullet
