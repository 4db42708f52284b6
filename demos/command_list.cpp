// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/bench/event_scenes.h"
#include "demos/bench/subject.h"
#include "demos/commands.h"
#include "demos/program/exit_code.h"
#include "demos/scenes/box_scene.h"
#include "demos/scenes/world_scene.h"

#include <cstdio>

namespace cullet
{
namespace
{
int printLists()
{
    std::puts("Scenes of boxes (bench broad --scene):");
    for (const BoxSceneInfo& scene : boxScenes())
        std::printf("  %-14s %s\n", scene.name, scene.summary);
    for (const EventSceneInfo& scene : eventScenes())
        std::printf("  %-14s %s\n", scene.name, scene.summary);
    std::puts("Scenes of bodies (run, bench world, record, render --scene):");
    for (const WorldSceneInfo& scene : worldScenes())
        std::printf("  %-14s %s\n", scene.name, scene.summary);
    std::puts("Backends (--backend):");
    for (const SubjectInfo& subject : subjectNames())
    {
        if (subject.package == nullptr)
            std::printf("  %-14s %s%s\n", subject.name, subject.summary,
                        subject.hasBackend ? "" : " [through bullet only]");
    }
    std::puts("Other libraries, for bench broad (--backend rivals: all that are built in):");
    for (const SubjectInfo& subject : subjectNames())
    {
        if (subject.package != nullptr)
            std::printf("  %-15s %s%s%s%s\n", subject.name, subject.summary,
                        subject.isBuilt ? "" : " [not built in; install ",
                        subject.isBuilt ? "" : subject.package, subject.isBuilt ? "" : " and build again]");
    }
    return kExitOk;
}
}  // namespace

void addListCommand(CLI::App& program, Action& chosen)
{
    CLI::App* command = program.add_subcommand("list", "Print the scenes and the backends");
    command->footer("Example:\n  cullet list | less\n");
    command->callback([&chosen] { chosen = printLists; });
}
}  // namespace cullet
