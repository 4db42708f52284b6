// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/events/event_scenes.h"
#include "cullet/demos/bench/subject.h"
#include "cullet/demos/commands/commands.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/files/result_file.h"
#include "cullet/demos/scenes/bodies/world_scene.h"
#include "cullet/demos/scenes/box_scene.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

namespace cullet
{
namespace
{
/// Prints a name, and adds it to the file.
void show(const char* kind, const char* name, const char* summary, const std::string& note, bool isThere,
          ResultFile& file)
{
    std::printf("  %-15s %s%s\n", name, summary, note.c_str());
    file.addRow({{"kind", kind}, {"name", name}, {"summary", summary}, {"available", isThere}});
}

void showScenes(ResultFile& file)
{
    std::puts("Scenes of boxes (bench broad --scene):");
    for (const BoxSceneInfo& scene : boxScenes())
        show("boxes", scene.name, scene.summary, "", true, file);
    for (const EventSceneInfo& scene : eventScenes())
        show("boxes", scene.name, scene.summary, "", true, file);
    std::puts("Scenes of bodies (run, bench world, record, render --scene):");
    for (const WorldSceneInfo& scene : worldScenes())
        show("bodies", scene.name, scene.summary, "", true, file);
}

void showBackends(ResultFile& file)
{
    std::puts("Backends (--backend):");
    for (const SubjectInfo& subject : subjectNames())
    {
        if (subject.package == nullptr)
            show("backend", subject.name, subject.summary, subject.hasBackend ? "" : " [through bullet only]",
                 true, file);
    }
    std::puts("Other libraries, for bench broad (--backend rivals: all that are built in):");
    for (const SubjectInfo& subject : subjectNames())
    {
        if (subject.package != nullptr)
            show("rival", subject.name, subject.summary,
                 subject.isBuilt
                     ? ""
                     : std::string(" [not built in; install ") + subject.package + " and build again]",
                 subject.isBuilt, file);
    }
}

int listCommand(const std::string& json, const std::string& csv)
{
    ResultFile file({{"command", "list"}}, json, csv);
    showScenes(file);
    showBackends(file);
    file.save();
    return kExitOk;
}
}  // namespace

void addListCommand(CLI::App& program, Action& chosen)
{
    CLI::App* command = program.add_subcommand("list", "Print the scenes and the backends");
    command->footer("Examples:\n  cullet list | less\n  cullet list --json names.json\n");
    const auto files = std::make_shared<std::pair<std::string, std::string>>();
    command->add_option("--json", files->first, "write the lists to this file");
    command->add_option("--csv", files->second, "write the lists to this file");
    command->callback([=, &chosen] { chosen = [=] { return listCommand(files->first, files->second); }; });
}
}  // namespace cullet
