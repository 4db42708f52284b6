// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/recording/box_stream.h"
#include "cullet/tests/demos/program.h"

#include <set>

namespace cullet
{
namespace
{
using nlohmann::json;

/// A recording of a small scene, made once for all tests of this process.
const std::string& smallRecording()
{
    static const std::string path = []
    {
        const std::string made = temporaryPath("small.cbx");
        Outcome outcome;
        const json document =
            runForJson("record --scene boxes --bodies 80 --steps 50 --backend grid --out " + made, &outcome);
        EXPECT_EQ(outcome.code, 0) << outcome.errors;
        EXPECT_EQ(document["rows"][0]["frames"], 50);
        EXPECT_EQ(document["rows"][0]["bodies"], 80);
        EXPECT_EQ(document["rows"][0]["hash"].get<std::string>().size(), 16u);
        EXPECT_EQ(document["rows"][0]["bytes"], readText(made).size());
        EXPECT_TRUE(contains(outcome.output, "commit "));
        return made;
    }();
    return path;
}

TEST(RecordCommand, RecordsSameWorldAsRunCommand)
{
    const auto hashOf = [](const json& document) { return document["rows"][0]["hash"].get<std::string>(); };
    const std::string path = temporaryPath("same.cbx");
    const std::string scene = " --scene boxes --bodies 50 --steps 40 --backend grid";
    EXPECT_EQ(hashOf(runForJson("record --out " + path + scene)),
              hashOf(runForJson("run --check 0 --parts broadphase" + scene)));
    std::remove(path.c_str());
}

TEST(RecordCommand, TracesEveryPhaseOfEveryStep)
{
    const std::string path = temporaryPath("traced.cbx"), trace = temporaryPath("traced.json");
    const Outcome outcome = runProgram("record --scene boxes --bodies 10 --steps 7 --backend grid --out " +
                                       path + " --trace " + trace);
    EXPECT_EQ(outcome.code, 0) << outcome.errors;
    std::map<std::string, int> counts = countSpans(json::parse(readText(trace), nullptr, false));
    std::remove(path.c_str());
    std::remove(trace.c_str());
    EXPECT_EQ(counts["grid"], 1);
    EXPECT_EQ(counts["step 1"], 7);
    EXPECT_EQ(counts["calculateOverlappingPairs 1"], 7);
}

TEST(ReplayCommand, TimesEveryBackendOnTheSamePairs)
{
    Outcome outcome;
    const json document =
        runForJson("replay --backend grid,dbvt,psap,axissweep --threads 1 " + smallRecording(), &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    ASSERT_EQ(document["rows"].size(), 12u);
    std::set<std::string> backends;
    for (const json& row : document["rows"])
    {
        backends.insert(row["backend"].get<std::string>());
        EXPECT_EQ(row["hash"], document["rows"][0]["hash"]);
        EXPECT_EQ(row["bodies"], 85) << "with the floor and the walls";
        EXPECT_EQ(row["frames"], 50);
        EXPECT_GT(row["pairs"], 80);
        EXPECT_GE(row["held_pairs"], row["pairs"]);
        EXPECT_LE(row["min_ms"], row["median_ms"]);
    }
    EXPECT_EQ(backends, (std::set<std::string>{"axissweep", "dbvt", "grid", "psap"}));
    EXPECT_EQ(runForJson("replay --steps 3 " + smallRecording())["rows"][0]["frames"], 3);
}

TEST(VerifyCommand, PrintsTheHashOfEachBackendAndTracesItsFrames)
{
    const std::string trace = temporaryPath("verify.json");
    const Outcome outcome = runProgram("verify --steps 9 --trace " + trace + " " + smallRecording());
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    std::map<std::string, int> counts = countSpans(json::parse(readText(trace), nullptr, false));
    std::remove(trace.c_str());
    for (const std::string lane : {"1", "2", "3"})
        EXPECT_EQ(counts["calculateOverlappingPairs " + lane], 9);
    std::map<std::string, int> hashes;
    for (const std::string backend : {"exact", "grid", "dbvt"})
    {
        EXPECT_EQ(counts[backend], 1) << "a lane";
        const std::size_t at = outcome.output.find("verify   " + backend + " ");
        ASSERT_NE(at, std::string::npos) << outcome.output;
        const std::size_t end = outcome.output.find('\n', at);
        ++hashes[outcome.output.substr(end - 16, 16)];
    }
    EXPECT_EQ(hashes.size(), 1u) << outcome.output;
}

TEST(VerifyCommand, AgreesInBothPrecisions)
{
    Outcome outcome;
    const json document = runForJson("verify " + smallRecording(), &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    EXPECT_EQ(document["rows"].size(), 3u);
    EXPECT_EQ(document["rows"][0]["frames"], 50);
    EXPECT_GT(document["rows"][0]["pairs"], 50 * 80);
    EXPECT_TRUE(contains(outcome.output, "50 frames: the same pairs in each"));
    const Outcome asDouble = runProgram("verify --precision double " + smallRecording());
    EXPECT_EQ(asDouble.code, 0) << asDouble.errors;
    EXPECT_TRUE(contains(asDouble.output, "hash " + document["rows"][0]["hash"].get<std::string>()));
}

TEST(VerifyCommand, ExitsWithOneAtFirstDifference)
{
    // A filter word changes between frames, which DBVT does not re-evaluate.
    const std::string path = temporaryPath("differ.cbx");
    BoxStreamWriter writer(path, StreamPrecision::Float);
    writer.create(0, {{0, 0, 0}, {1, 1, 1}}, 1, 1);
    writer.create(1, {{0.5, 0, 0}, {1, 1, 1}}, 2, -1);
    writer.frame();
    writer.filter(0, 1, -1);
    writer.frame();
    ASSERT_TRUE(writer.finish());
    Outcome outcome;
    const json document = runForJson("verify --backend grid,dbvt " + path, &outcome);
    EXPECT_EQ(outcome.code, 1);
    const std::string expected =
        "frame 1: pair (0, 1) is found by 'grid' and not by 'dbvt'\n"
        "  box 0: (0, 0, 0) to (1, 1, 1), group 1, mask -1\n"
        "  box 1: (0.5, 0, 0) to (1, 1, 1), group 2, mask -1";
    EXPECT_TRUE(contains(outcome.output, expected)) << outcome.output;
    EXPECT_EQ(document["rows"][0]["difference"], expected);
    EXPECT_EQ(runProgram("replay --backend grid,dbvt " + path).code, 1);
    std::remove(path.c_str());
}

TEST(RecordingCommands, ExplainMissingBrokenAndUnknownInputs)
{
    const std::string path = temporaryPath("cut.cbx");
    const std::string bytes = readText(smallRecording());
    std::ofstream(path, std::ios::binary) << bytes.substr(0, bytes.size() / 2);
    for (const std::string command : {"replay ", "verify "})
    {
        const Outcome missing = runProgram(command + "/nowhere/a.cbx");
        EXPECT_EQ(missing.code, 3);
        EXPECT_EQ(missing.errors, "cullet: recording '/nowhere/a.cbx': No such file or directory\n");
        EXPECT_EQ(runProgram(command + "/tmp").errors, "cullet: recording '/tmp': is a folder\n");
        const Outcome cut = runProgram(command + path);
        EXPECT_EQ(cut.code, 3);
        EXPECT_TRUE(contains(cut.errors, "truncated")) << cut.errors;
        const Outcome backend = runProgram(command + smallRecording() + " --backend gird");
        EXPECT_EQ(backend.code, 2);
        EXPECT_TRUE(contains(backend.errors, "axissweep")) << backend.errors;
        const Outcome help = runProgram(command + "--help");
        EXPECT_EQ(help.code, 0);
        EXPECT_TRUE(contains(help.output, "Examples:"));
    }
    std::remove(path.c_str());
    const Outcome nowhere = runProgram("record --bodies 10 --out /nowhere/a.cbx");
    EXPECT_EQ(nowhere.code, 4);
    EXPECT_TRUE(contains(nowhere.errors, "/nowhere/a.cbx")) << nowhere.errors;
    const Outcome scene = runProgram("record --scene dorp");
    EXPECT_EQ(scene.code, 2);
    EXPECT_TRUE(contains(scene.errors, "drop, ")) << scene.errors;
}

TEST(RecordCommand, FinishesTheFileWhenInterrupted)
{
    const std::string path = temporaryPath("interrupted.cbx");
    const Outcome outcome = runShell("timeout --preserve-status -s INT 2 " + std::string(CULLET_PROGRAM) +
                                     " record --scene boxes --bodies 50 --steps 100000000 --out " + path);
    EXPECT_EQ(outcome.code, 130) << outcome.errors;
    EXPECT_TRUE(contains(outcome.output, "(interrupted)")) << outcome.output;
    EXPECT_EQ(runProgram("verify --steps 20 " + path).code, 0);
    std::remove(path.c_str());
}
}  // namespace
}  // namespace cullet
