// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/commands.h"
#include "demos/drop/drop_report.h"
#include "demos/program/exit_code.h"
#include "demos/program/machine.h"
#include "demos/program/precision.h"
#include "demos/scenes/mesh_hull.h"

#include <cstdio>
#include <filesystem>
#include <memory>

namespace cullet
{
namespace
{
struct RunOptions
{
    DropOptions drop;
    std::vector<std::string> meshes;
    double dt = 1.0 / 60.0;
    std::string precision = ownPrecision();
    std::string json;
    std::string csv;
};

/// The meshes of Debian's package glmark2-data that are there.
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

BodyShapes makeShapes(const RunOptions& options)
{
    BodyShapes shapes;
    for (const std::string& path : options.meshes.empty() ? findDefaultMeshes() : options.meshes)
    {
        try
        {
            const HullPoints hull = loadMeshHull(path);
            std::printf("mesh %s: %zu vertices, hull of %zu\n", hull.name.c_str(), hull.meshVertices,
                        hull.points.size());
            shapes.addHull(hull);
        }
        catch (const MeshError& error)
        {
            throw ProgramError(kExitInput, error.what());
        }
    }
    shapes.addBox(btScalar(0.7));
    shapes.addSphere(btScalar(0.4));
    return shapes;
}

Json toJson(const RunOptions& options)
{
    const DropOptions& drop = options.drop;
    return {{"command", "run"},         {"bodies", drop.world.bodies},
            {"steps", drop.steps},      {"seed", drop.world.seed},
            {"dt", options.dt},         {"backend", drop.backend},
            {"threads", drop.threads},  {"precision", ownPrecision()},
            {"check", drop.auditEvery}, {"mesh", options.meshes}};
}

int runCommand(RunOptions options)
{
    ResultFile file(toJson(options), options.json, options.csv);
    options.drop.world.dt = btScalar(options.dt);
    std::printf("%s\ncommit %s\n", toLine(describeMachine()).c_str(), builtCommit());
    if (isDebugBuild())
        std::puts("note: this is a debug build; its times mean nothing");
    const BodyShapes shapes = makeShapes(options);
    std::fflush(stdout);
    const DropResult result = runDrop(options.drop, shapes);
    printReport(options.drop, result);
    addRows(options.drop, result, file);
    file.save();
    if (!result.audits.agrees())
        return kExitDisagreement;
    return result.interrupted ? kExitInterrupted : kExitOk;
}
}  // namespace

void addRunCommand(CLI::App& program, Action& chosen)
{
    CLI::App* command = program.add_subcommand(
        "run", "Drop bodies in two worlds, cullet's and DBVT's, and print times and pairs side by side");
    const auto options = std::make_shared<RunOptions>();
    DropOptions& drop = options->drop;
    command->add_option("--bodies", drop.world.bodies, "bodies in each world")
        ->capture_default_str()
        ->check(CLI::Range(1, 10000000));
    command->add_option("--steps", drop.steps, "steps of each world")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000000));
    command->add_option("--dt", options->dt, "length of a step, seconds")
        ->capture_default_str()
        ->check(CLI::Range(1e-6, 1.0));
    command->add_option("--seed", drop.world.seed, "of places, rotations and shapes")->capture_default_str();
    command->add_option("--backend", drop.backend, "broad phase of the first world")
        ->capture_default_str()
        ->check(CLI::IsMember({"auto", "cuda", "grid", "brute", "dbvt"}));
    command->add_option("--threads", drop.threads, "of the CPU backends; 0: all cores")
        ->capture_default_str()
        ->check(CLI::Range(0, 4096));
    command->add_option("--precision", options->precision, "of Bullet")
        ->capture_default_str()
        ->check(CLI::IsMember({"float", "double"}));
    command->add_option("--mesh", options->meshes,
                        "mesh files whose convex hulls fall; default: glmark2's models");
    command->add_option("--check", drop.auditEvery, "steps between two comparisons of the pairs; 0: none")
        ->capture_default_str();
    command->add_option("--json", options->json, "write results to this file");
    command->add_option("--csv", options->csv, "write results to this file");
    command->add_flag("--quiet", drop.quiet, "no progress bar");
    command->callback([options, &chosen] { chosen = [options] { return runCommand(*options); }; });
}
}  // namespace cullet
