// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/commands/command_bench.h"
#include "cullet/demos/figures/figure.h"
#include "cullet/demos/figures/plots.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

namespace cullet
{
namespace
{
struct FigureCommand
{
    std::vector<std::string> names;
    std::string out = "figures";
    bool noPlots = false;
    std::string json, csv, trace;
    std::string precision = ownPrecision();
    FigureOptions options;
};

/// Throws for an unknown figure name, listing the known ones.
void requireKnown(const std::vector<std::string>& names)
{
    std::string known;
    for (const FigureInfo& figure : figures())
        known += std::string(figure.name) + ", ";
    known += "all";
    for (const std::string& name : names)
    {
        if (name != "all" && findFigure(name) == nullptr)
            throw ProgramError(kExitUsage, "unknown figure '" + name + "'; known: " + known);
    }
}

std::vector<const FigureInfo*> chosenFigures(const std::vector<std::string>& names)
{
    std::vector<const FigureInfo*> chosen;
    for (const FigureInfo& figure : figures())
    {
        for (const std::string& name : names)
        {
            if (name == figure.name || name == "all")
            {
                chosen.push_back(&figure);
                break;
            }
        }
    }
    return chosen;
}

void makeFolder(const std::string& path)
{
    std::error_code error;
    std::filesystem::create_directories(path, error);
    if (error)
        throw ProgramError(kExitOutput, "folder '" + path + "': " + error.message());
}

/// Measures one figure into its own file and appends its rows to `all`.
///
/// @return whether there is something to draw
bool measureFigure(const FigureInfo& figure, const FigureCommand& command, ResultFile& all)
{
    const std::string path = command.out + "/" + figureFileName(figure.name) + ".csv";
    ResultFile file({{"command", "figure"}, {"figure", figure.name}}, "", path);
    const auto save = [&]
    {
        file.save();
        for (Json row : file.rows())
        {
            row["figure"] = figure.name;
            all.addRow(std::move(row));
        }
        all.save();
    };
    try
    {
        figure.measure(command.options, file);
    }
    catch (const ProgramError&)
    {
        save();
        throw;
    }
    save();
    return !file.rows().empty();
}

Json toJson(const FigureCommand& command)
{
    const FigureOptions& options = command.options;
    return {{"command", "figure"},      {"name", command.names},       {"quick", options.quick},
            {"bodies", options.bodies}, {"most", options.most},        {"budget", options.budget},
            {"seed", options.seed},     {"precision", ownPrecision()}, {"out", command.out}};
}

int runFigures(FigureCommand command)
{
    requireKnown(command.names);
    requireReleaseBuild();
    makeFolder(command.out);
    ResultFile all(toJson(command), command.json, command.csv);
    std::optional<TraceFile> trace;
    command.options.trace = openTrace(trace, command.trace);
    printHead();
    const std::vector<const FigureInfo*> chosen = chosenFigures(command.names);
    std::vector<std::string> files;
    for (std::size_t i = 0; i < chosen.size() && !isInterrupted(); ++i)
    {
        std::fprintf(stderr, "figure %s (%zu of %zu): %s\n", chosen[i]->name, i + 1, chosen.size(),
                     chosen[i]->summary);
        if (measureFigure(*chosen[i], command, all))
            files.push_back(figureFileName(chosen[i]->name));
    }
    closeTrace(trace);
    if (!files.empty() && !command.noPlots)
        drawFigures(command.out, files);
    return isInterrupted() ? kExitInterrupted : kExitOk;
}
}  // namespace

void addFigureCommand(CLI::App& program, Action& chosen)
{
    CLI::App* command = program.add_subcommand(
        "figure", "Measure and draw the thesis's figures and others: CSV, SVG and PNG");
    std::string footer = "Figures:\n";
    for (const FigureInfo& figure : figures())
    {
        footer += std::string("  ") + figure.name + std::string(10 - std::string(figure.name).size(), ' ') +
                  figure.summary + "\n";
    }
    footer += "Examples:\n  cullet figure 10 --quick\n  cullet figure all --out /tmp/figures";
    command->footer(footer);
    const auto settings = std::make_shared<FigureCommand>();
    command->add_option("name", settings->names, "one or several, or all")->required();
    command->add_flag("--quick", settings->options.quick, "smaller worlds, fewer frames");
    command->add_option("--out", settings->out, "folder for the files")->capture_default_str();
    command->add_flag("--no-plots", settings->noPlots, "CSV files only");
    command->add_option("--bodies", settings->options.bodies, "sizes of worlds instead of the figure's own")
        ->delimiter(',')
        ->check(CLI::Range(2, 100000000));
    command->add_option("--most", settings->options.most, "leave out larger worlds")
        ->check(CLI::Range(1000, 100000000));
    command
        ->add_option(
            "--budget", settings->options.budget,
            "seconds for each figure, 2.5 times as many for phases: larger worlds that would exceed it are "
            "left out; 0: none are")
        ->capture_default_str()
        ->check(numberIn(0.0, 1e9));
    command->add_option("--json", settings->json, "write the rows of all figures to this file");
    command->add_option("--csv", settings->csv, "write the rows of all figures to this file");
    command->add_option(
        "--trace", settings->trace,
        "write the phases of all frames and steps to this file, for Perfetto; figure 11 has none");
    command->add_option("--precision", settings->precision, "of Bullet")
        ->capture_default_str()
        ->check(CLI::IsMember({"float", "double"}));
    command->add_option("--seed", settings->options.seed, "of the scenes")
        ->capture_default_str()
        ->check(notNegative());
    command->add_flag("--quiet", settings->options.quiet, "no progress bar");
    command->callback([=, &chosen] { chosen = [=] { return runFigures(*settings); }; });
}
}  // namespace cullet
