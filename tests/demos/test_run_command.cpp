// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/demos/program.h"

#include <cmath>
#include <map>
#include <set>
#include <vector>

namespace cullet
{
namespace
{
using nlohmann::json;

constexpr const char* kTiny = "run --bodies 120 --steps 45 --check 15 --backend grid --threads 2";

/// Rows of a document by part and benchmark.
std::map<std::string, json> rowsByName(const json& document)
{
    std::map<std::string, json> rows;
    for (const json& row : document["rows"])
        rows[row["part"].get<std::string>() + " " + row["benchmark"].get<std::string>()] = row;
    return rows;
}

TEST(RunCommand, WritesMachineCommitOptionsAndRowsThatAddUp)
{
    Outcome outcome;
    const json document = runForJson(kTiny, &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    ASSERT_TRUE(document.is_object());
    EXPECT_GT(document["machine"]["cores"].get<int>(), 0);
    EXPECT_FALSE(document["machine"]["cpu"].get<std::string>().empty());
    const std::string instructions = document["machine"]["instructions"].get<std::string>();
    EXPECT_TRUE(instructions == "AVX-512" || instructions == "AVX2" || instructions == "baseline");
    EXPECT_TRUE(contains(outcome.output, ", " + instructions + ", ")) << outcome.output;
    EXPECT_FALSE(document["commit"].get<std::string>().empty());
    EXPECT_EQ(document["options"]["bodies"], 120);
    std::map<std::string, json> rows = rowsByName(document);
    for (const std::string part : {"stock", "broadphase", "dispatcher", "world"})
    {
        SCOPED_TRACE(part);
        double sum = 0.0;
        for (const char* phase : {"updateAabbs", "calculateOverlappingPairs", "dispatch", "islands", "solver",
                                  "integrate", "rest"})
            sum += rows[part + " run." + phase]["mean_ms"].get<double>();
        const json& step = rows[part + " run.step"];
        EXPECT_NEAR(sum, step["mean_ms"].get<double>(), 1e-6 + 1e-6 * sum);
        EXPECT_LE(step["min_ms"], step["median_ms"]);
        EXPECT_LE(step["median_ms"], step["p90_ms"]);
        EXPECT_EQ(step["steps"], 45);
        EXPECT_EQ(step["precision"], "float");
        EXPECT_EQ(step["hash"].get<std::string>().size(), 16u);
        EXPECT_GT(step["contact_pairs"], 0) << "nothing has landed: the run shows nothing";
        EXPECT_GE(step["overlapping_pairs"], step["contact_pairs"]);
        EXPECT_GE(step["pairs"], step["overlapping_pairs"]);
        EXPECT_GT(step["bytes"], 0);
        EXPECT_EQ(step["audits"], 3);
        EXPECT_EQ(step["audits_agree"], true);
        EXPECT_EQ(step["backend"], part == "stock" ? "dbvt" : "grid");
        EXPECT_EQ(step["narrow"], part == "stock" || part == "broadphase" ? "bullet" : "dispatcher");
        EXPECT_EQ(step["update"], part == "world" ? "parallel" : "bullet");
    }
    EXPECT_EQ(rows["world run.step"]["hash"], rows["dispatcher run.step"]["hash"])
        << "cullet::World changes no bit";
    EXPECT_TRUE(contains(outcome.output, "same boxes into both 3/3, same states with World: yes: agree"))
        << outcome.output;
}

TEST(RunCommand, StatesSpeedInOneSentenceAboveTable)
{
    const Outcome outcome =
        runProgram("run --scene boxes --bodies 120 --steps 45 --backend grid --threads 2");
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    const std::size_t sentence = outcome.output.find("\nA step takes ");
    ASSERT_NE(sentence, std::string::npos) << outcome.output;
    EXPECT_TRUE(contains(outcome.output, " (+ World against stock Bullet, mean)\n")) << outcome.output;
    EXPECT_LT(sentence, outcome.output.find("updateAabbs")) << "on top of the table";
    for (const char* title : {"  stock Bullet", "  + Broadphase", "  + Dispatcher", "  + World"})
        EXPECT_TRUE(contains(outcome.output, title)) << title;
    EXPECT_TRUE(contains(outcome.output, "120 bodies, 45 of 45 steps")) << outcome.output;
    for (const char* part : {"stock 45/45", "broadphase 45/45", "dispatcher 45/45", "world 45/45"})
        EXPECT_TRUE(contains(outcome.output, part)) << "the pairs of every step: " << outcome.output;
}

TEST(RunCommand, MeasuresEachNamedPartOnce)
{
    const auto partsOf = [](const std::string& arguments)
    {
        const json document =
            runForJson("run --scene boxes --bodies 30 --steps 6 --backend grid " + arguments);
        std::vector<std::string> parts;
        for (const json& row : document["rows"])
        {
            if (row["benchmark"] == "run.step")
                parts.push_back(row["part"].get<std::string>() + " " + row["narrow"].get<std::string>());
        }
        return parts;
    };
    using Parts = std::vector<std::string>;
    EXPECT_EQ(partsOf("--parts world,stock"), (Parts{"stock bullet", "world dispatcher"}));
    EXPECT_EQ(partsOf("--parts dispatcher --parts dispatcher"), Parts{"dispatcher dispatcher"});
    EXPECT_EQ(partsOf("--parts stock"), Parts{"stock bullet"});
    EXPECT_EQ(partsOf("--narrow isa-gjk"), (Parts{"stock isa-gjk", "broadphase isa-gjk", "world isa-gjk"}));
    EXPECT_EQ(partsOf("--narrow bullet --parts stock,broadphase"),
              (Parts{"stock bullet", "broadphase bullet"}));
    EXPECT_EQ(runProgram("run --parts stock,all").code, 2);
    const Outcome both = runProgram("run --narrow isa-gjk --parts dispatcher");
    EXPECT_EQ(both.code, 2);
    EXPECT_TRUE(contains(both.errors, "--narrow")) << both.errors;
}

TEST(RunCommand, ComparesOtherBroadPhasesUnderTheirName)
{
    const Outcome outcome =
        runProgram("run --scene boxes --bodies 1 --steps 1 --backend dbvt-deferred --parts stock,broadphase");
    EXPECT_EQ(outcome.code, 0) << outcome.errors;
    EXPECT_TRUE(contains(outcome.output, "+ dbvt-deferred")) << outcome.output;
    EXPECT_TRUE(contains(outcome.output, "1 body, 1 of 1 step,")) << outcome.output;
}

TEST(RunCommand, AgreesInScenesWithGhostsSoftBodiesAndBodiesThatComeAndGo)
{
    for (const std::string scene : {"pour", "stampede", "soft", "crowd"})
    {
        const Outcome outcome =
            runProgram("run --scene " + scene + " --bodies 40 --steps 20 --backend grid --threads 2");
        EXPECT_EQ(outcome.code, 0) << scene << outcome.output << outcome.errors;
        EXPECT_TRUE(contains(outcome.output, "same states with World: yes: agree"))
            << scene << outcome.output;
    }
}

TEST(RunCommand, WorksAsProgramOfItsOwn)
{
    const std::string program = CULLET_RUN_PROGRAM;
    const Outcome outcome = runShell(program + " run --scene boxes --bodies 30 --steps 5");
    EXPECT_EQ(outcome.code, 0) << outcome.errors;
    EXPECT_TRUE(contains(outcome.output, "agree")) << outcome.output;
    EXPECT_TRUE(
        contains(runShell(program + " run --scene boxes --bodies 5 --steps 2 --precision double").output,
                 "double precision"));
    EXPECT_EQ(runShell(program + " bench").errors, "cullet: unknown command 'bench'; known: run\n");
}

TEST(RunCommand, RepeatsBitForBitWithAnyThreadCountButNotWithOtherSeed)
{
    const auto hashOf = [](const std::string& extra)
    {
        const json document =
            runForJson("run --bodies 100 --steps 40 --check 0 --backend grid --parts world " + extra);
        return rowsByName(document)["world run.step"]["hash"].get<std::string>();
    };
    const std::string first = hashOf("--threads 1");
    EXPECT_EQ(hashOf("--threads 1"), first);
    EXPECT_EQ(hashOf("--threads 3"), first);
    EXPECT_NE(hashOf("--threads 1 --seed 2"), first);
}

TEST(RunCommand, RunsInDoublePrecision)
{
    Outcome outcome;
    const json document = runForJson("run --bodies 60 --steps 30 --precision double", &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    for (const json& row : document["rows"])
        EXPECT_EQ(row["precision"], "double");
    EXPECT_TRUE(contains(outcome.output, "double precision"));
    EXPECT_EQ(runProgram("run --bodies 5 --steps 1 --precision=half").code, 2);
}

TEST(RunCommand, WritesCsvWithOneLinePerRow)
{
    const std::string path = temporaryPath("result.csv");
    ASSERT_EQ(runProgram("run --bodies 20 --steps 5 --csv " + path).code, 0);
    std::istringstream text(readText(path));
    std::remove(path.c_str());
    std::string line;
    std::getline(text, line);
    EXPECT_EQ(
        line.rfind("benchmark,scene,backend,precision,threads,bodies,pairs,median_ms,p90_ms,min_ms,hash", 0),
        0u)
        << line;
    EXPECT_TRUE(contains(line, ",commit,machine")) << line;
    int rows = 0;
    while (std::getline(text, line))
    {
        ++rows;
        EXPECT_TRUE(contains(line, " core")) << "the line of the machine: " << line;
    }
    EXPECT_EQ(rows, 36) << "seven phases, the broad phase and the step, of four worlds";
}

TEST(RunCommand, TracesEveryPhaseOfEveryStep)
{
    const std::string path = temporaryPath("trace.json");
    const json document =
        runForJson("run --scene boxes --bodies 30 --steps 10 --check 0 --backend grid --trace " + path);
    const json trace = json::parse(readText(path), nullptr, false);
    std::remove(path.c_str());
    ASSERT_TRUE(trace.is_array());
    std::map<std::string, int> counts = countSpans(trace);
    double steps = 0.0;
    for (const json& event : trace)
    {
        if (event["ph"] == "X" && event["name"] == "step" && event["tid"] == 1)
            steps += event["dur"].get<double>();
    }
    for (const char* part : {"stock", "broadphase", "dispatcher", "world"})
        EXPECT_EQ(counts[part], 1) << part;
    for (const char* name : {"step 1", "step 4", "calculateOverlappingPairs 1", "updateAabbs 2",
                             "dispatchAllCollisionPairs 3", "solveConstraints 4"})
        EXPECT_EQ(counts[name], 10) << name;
    const double mean = rowsByName(document)["stock run.step"]["mean_ms"].get<double>();
    EXPECT_NEAR(steps / 1e4, mean, 0.05 * mean) << "of ten steps, in microseconds";
    EXPECT_EQ(runProgram("run --bodies 5 --steps 1 --trace /nowhere/t.json").code, 4);
}

TEST(Program, ReportsUnwritableTraceAfterWritingResults)
{
    const std::string recording = temporaryPath("full.cbx"), results = temporaryPath("full.json");
    const std::string film = temporaryPath("full.gltf");
    for (const std::string& command : std::vector<std::string>{
             "run --scene boxes --bodies 5 --steps 3 --check 0",
             "record --scene boxes --bodies 5 --steps 3 --out " + recording,
             "replay --backend grid " + recording, "verify --backend exact,grid " + recording,
             "bench broad --scene W1 --bodies 100 --backend grid --frames 2 --warmup 1",
             "bench world --scene boxes --bodies 5 --steps 10 --backend grid",
             "render --bodies 5 --steps 3 --gltf " + film})
    {
        const Outcome outcome = runProgram(command + " --trace /dev/full --json " + results);
        EXPECT_EQ(outcome.code, 4) << command << outcome.errors;
        EXPECT_EQ(outcome.errors, "cullet: trace file '/dev/full': cannot be written\n") << command;
        EXPECT_TRUE(json::parse(readText(results), nullptr, false).is_object()) << command;
        std::remove(results.c_str());
    }
    for (const std::string& path : {recording, film})
        std::remove(path.c_str());
}

TEST(RunCommand, ClosesItsTraceWhenInterrupted)
{
    const std::string path = temporaryPath("interrupted.json");
    const Outcome outcome = runShell("timeout --preserve-status -s INT 1 " + std::string(CULLET_PROGRAM) +
                                     " run --scene boxes --bodies 20 --steps 100000000 --trace " + path);
    EXPECT_EQ(outcome.code, 130);
    const json trace = json::parse(readText(path), nullptr, false);
    std::remove(path.c_str());
    ASSERT_TRUE(trace.is_array());
    EXPECT_GT(trace.size(), 10u);
}

TEST(RunCommand, NamesAMissingMesh)
{
    const Outcome outcome = runProgram("run --mesh /nowhere/rabbit.obj");
    EXPECT_EQ(outcome.code, 3);
    EXPECT_EQ(outcome.errors, "cullet: mesh '/nowhere/rabbit.obj': no such file\n");
}

TEST(RunCommand, NamesABrokenAndAnEmptyMesh)
{
    for (const char* text : {"", "neither vertices nor faces, but long enough"})
    {
        const std::string path = temporaryPath("broken.obj");
        std::ofstream(path) << text;
        const Outcome outcome = runProgram("run --mesh " + path);
        std::remove(path.c_str());
        EXPECT_EQ(outcome.code, 3) << text;
        EXPECT_TRUE(contains(outcome.errors, path)) << outcome.errors;
        EXPECT_EQ(outcome.errors.find('\n'), outcome.errors.size() - 1) << "one line: " << outcome.errors;
    }
}

TEST(RunCommand, TakesTheMeshesThatAreNamed)
{
    const std::string path = temporaryPath("pyramid.obj");
    std::ofstream(path) << "v 0 0 0\nv 3 0 0\nv 0 3 0\nv 0 0 3\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n";
    const Outcome outcome = runProgram("run --bodies 20 --steps 5 --mesh " + path);
    std::remove(path.c_str());
    EXPECT_EQ(outcome.code, 0) << outcome.errors;
    EXPECT_TRUE(contains(outcome.output, "hull of 4")) << outcome.output;
    EXPECT_FALSE(contains(outcome.output, "bunny"));
}

TEST(RunCommand, RefusesAResultFileThatCannotBeWrittenBeforeItSteps)
{
    const Outcome outcome = runProgram("run --bodies 100000 --steps 100000 --json /nowhere/result.json");
    EXPECT_EQ(outcome.code, 4);
    EXPECT_TRUE(contains(outcome.errors, "/nowhere/result.json")) << outcome.errors;
}

TEST(RunCommand, ShowsItsProgressOnATerminalOnly)
{
    EXPECT_EQ(runProgram("run --bodies 60 --steps 60").errors, "");
    const std::string arguments =
        std::string(CULLET_PROGRAM) + " run --bodies 300 --steps 100 --parts stock,world";
    if (std::system("command -v script >/dev/null") != 0)
        GTEST_SKIP() << "no program 'script' to make a terminal";
    EXPECT_TRUE(contains(runShell("script -qec '" + arguments + "' /dev/null").output, " left"));
    EXPECT_FALSE(contains(runShell("script -qec '" + arguments + " --quiet' /dev/null").output, " left"));
}

TEST(RunCommand, PrintsWhatItHasWhenInterrupted)
{
    const Outcome outcome = runShell("timeout --preserve-status -s INT 5 " + std::string(CULLET_PROGRAM) +
                                     " run --scene boxes --bodies 50 --steps 100000000");
    EXPECT_EQ(outcome.code, 130);
    EXPECT_TRUE(contains(outcome.output, "(interrupted)")) << outcome.output;
    EXPECT_TRUE(contains(outcome.output, "dispatch")) << outcome.output;
    EXPECT_TRUE(contains(outcome.output, "agree")) << outcome.output;
}

TEST(RunCommand, ReportsNoDisagreementWhenInterruptedBeforeFirstStep)
{
    const Outcome outcome = runShell("timeout --preserve-status -s INT 0.1 " + std::string(CULLET_PROGRAM) +
                                     " run --bodies 5000 --steps 100000000");
    EXPECT_EQ(outcome.code, 130) << outcome.output;
    EXPECT_FALSE(contains(outcome.output, "DISAGREE")) << outcome.output;
}

TEST(Program, RefusesInvalidNumbersBeforeAnyWork)
{
    for (const std::string arguments :
         {"run --dt nan", "run --dt 0", "run --seed -1", "run --check -1", "run --bodies 1e9",
          "bench broad --margin nan", "bench broad --budget nan", "bench broad --budget -1",
          "bench broad --seed -1", "figure 12 --budget nan", "replay a.cbx --steps -1",
          "render --gltf a.gltf --camera nan,1", "render --gltf a.gltf --fps nan",
          "render --gltf a.gltf --orbit inf"})
    {
        const Outcome outcome = runProgram(arguments);
        EXPECT_EQ(outcome.code, 2) << arguments;
        const std::string option = arguments.substr(arguments.rfind("--"));
        EXPECT_TRUE(contains(outcome.errors, option.substr(0, option.find(' ')))) << outcome.errors;
        EXPECT_EQ(outcome.output, "") << "before any work";
    }
}

TEST(Program, AnswersUnknownCommandWithKnownOnes)
{
    const Outcome outcome = runProgram("rnu --bodies 5");
    EXPECT_EQ(outcome.code, 2);
    EXPECT_EQ(outcome.errors,
              "cullet: unknown command 'rnu'; known: run, bench, figure, record, replay, "
              "verify, list, render\n");
    const Outcome bench = runProgram("bench board");
    EXPECT_EQ(bench.code, 2);
    EXPECT_EQ(
        bench.errors,
        "cullet: unknown command 'board'; known: broad, world, mesh, compounds, narrow, cuda, losses\n");
}

TEST(RunCommand, ExplainsWrongUsage)
{
    EXPECT_EQ(runProgram("").code, 2);
    EXPECT_EQ(runProgram("run --bodies 0").code, 2);
    EXPECT_EQ(runProgram("run --bodies many").code, 2);
    EXPECT_TRUE(contains(runProgram("run --scene boxes --file a.bullet").errors, "takes no --file"));
    const Outcome outcome = runProgram("run --backend gird");
    EXPECT_EQ(outcome.code, 2);
    EXPECT_TRUE(contains(outcome.errors, "grid")) << outcome.errors;
    const Outcome help = runProgram("run --help");
    EXPECT_EQ(help.code, 0);
    EXPECT_TRUE(contains(help.output, "--mesh"));
}

TEST(Program, PrintsHelpWithExamplesAndExitCodesForEveryCommand)
{
    for (const std::string command : {"run", "bench", "bench broad", "bench world", "bench narrow", "figure",
                                      "record", "replay", "verify", "render", "list"})
    {
        const Outcome help = runProgram(command + " --help");
        EXPECT_EQ(help.code, 0) << command;
        EXPECT_TRUE(contains(help.output, "Example")) << command;
        EXPECT_TRUE(contains(help.output, "3 input file")) << command;
        if (command == "bench")
            continue;
        for (const char* option : {"--json", "--csv"})
            EXPECT_TRUE(contains(help.output, option)) << command;
        // A query of a pair has no phases.
        const bool hasPhases = command != "list" && command != "bench narrow";
        EXPECT_EQ(contains(help.output, "--trace"), hasPhases) << command;
    }
}

TEST(Program, TakesSameOptionsInEveryCommandOnBodyScenes)
{
    for (const std::string command : {"run", "bench world", "record", "render"})
    {
        const Outcome help = runProgram(command + " --help");
        for (const char* option : {"--scene", "--bodies", "--steps", "--seed", "--backend", "--threads",
                                   "--precision", "--dt", "--narrow", "--mesh", "--file", "--quiet"})
            EXPECT_TRUE(contains(help.output, std::string("  ") + option + " ")) << command << " " << option;
        const Outcome unknown =
            runProgram(command + " --scene nowhere" + (command == "render" ? " --gltf x.gltf" : ""));
        if (contains(unknown.errors, "debug build"))
            continue;
        EXPECT_EQ(unknown.code, 2) << command;
        EXPECT_TRUE(contains(unknown.errors, "unknown scene 'nowhere'; known: drop, boxes"))
            << unknown.errors;
    }
}

TEST(ListCommand, PrintsScenesAndBackends)
{
    const Outcome outcome = runProgram("list");
    EXPECT_EQ(outcome.code, 0);
    for (const char* name : {"W1", "W3b", "queries", "hulls", "grid", "dbvt-deferred"})
        EXPECT_TRUE(contains(outcome.output, name)) << name;
    const json document = runForJson("list");
    std::map<std::string, std::set<std::string>> names;
    for (const json& row : document["rows"])
        names[row["kind"]].insert(row["name"].get<std::string>());
    EXPECT_EQ(names["boxes"].count("W3fresh"), 1u);
    EXPECT_GE(names["bodies"].size(), 20u);
    EXPECT_EQ(names["backend"].count("dbvt"), 1u);
    EXPECT_EQ(names["rival"].count("embree"), 1u);
    EXPECT_EQ(runProgram("list --json /nowhere/a.json").code, 4);
}
}  // namespace
}  // namespace cullet
