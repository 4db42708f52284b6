// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/exit_code.h"
#include "cullet/tests/demos/program.h"

#include <map>
#include <set>
#include <tuple>

namespace cullet
{
namespace
{
using nlohmann::json;

/// A debug build refuses to measure.
class BenchWorldCommand : public testing::Test
{
protected:
    void SetUp() override
    {
#ifndef NDEBUG
        GTEST_SKIP() << "a debug build refuses to measure, as it should";
#endif
    }
};

TEST_F(BenchWorldCommand, MeasuresWholeStepsAndKeepsStatesWithParallelUpdate)
{
    for (const std::string scene : {"boxes", "hulls"})
    {
        Outcome outcome;
        const json document = runForJson(
            "bench world --bodies 100 --falling 2:5 --settled 40:45 --backend grid,dbvt "
            "--scene " +
                scene,
            &outcome);
        ASSERT_EQ(outcome.code, 0) << outcome.errors;
        ASSERT_EQ(document["rows"].size(), 2u * 2u * 9u);
        for (const json& row : document["rows"])
        {
            EXPECT_EQ(row["scene"], scene);
            EXPECT_EQ(row["hash"].get<std::string>().size(), 16u);
            if (row["benchmark"] != "world.step.settled")
                continue;
            EXPECT_GT(row["contact_pairs"], 50);
            EXPECT_GT(row["median_ms"], 0.0);
        }
    }
    const json both = runForJson(
        "bench world --bodies 600 --falling 2:5 --settled 5:6 --backend grid --update bullet,parallel");
    ASSERT_EQ(both["rows"].size(), 2u * 2u * 9u);
    for (std::size_t row = 0; row < 9; ++row)
        EXPECT_EQ(both["rows"][row]["hash"], both["rows"][row + 9]["hash"]);
    EXPECT_EQ(both["rows"][9]["update"], "parallel");
    EXPECT_EQ(runProgram("bench world --falling 5:2").code, 2);
    EXPECT_EQ(runProgram("bench world --backend nothing").code, 2);
}

TEST_F(BenchWorldCommand, TakesOptionsOfRunForWholeStepsAndTracesTheirPhases)
{
    const std::string path = temporaryPath("world.json");
    const auto hashOf = [&](const std::string& extra)
    {
        const json document = runForJson(
            "bench world --scene pour --bodies 20 --steps 20 --backend grid,dbvt --threads 1 " + extra);
        for (const json& row : document["rows"])
        {
            if (row["benchmark"] == "world.step.settled" && row["backend"] == "grid")
                return row["hash"].get<std::string>() + " " + std::to_string(row["steps"].get<int>());
        }
        return std::string();
    };
    const std::string first = hashOf("--trace " + path);
    const json trace = json::parse(readText(path), nullptr, false);
    std::remove(path.c_str());
    std::map<std::string, int> counts = countSpans(trace);
    EXPECT_EQ(counts["grid, narrow bullet, update bullet, pour of 20"], 1);
    EXPECT_EQ(counts["dbvt, narrow bullet, update bullet, pour of 20"], 1);
    for (const char* name : {"step 1", "step 2", "calculateOverlappingPairs 1", "updateAabbs 2",
                             "dispatchAllCollisionPairs 2", "solveConstraints 1"})
        EXPECT_EQ(counts[name], 20) << name;
    EXPECT_EQ(first.size(), 18u) << first;
    EXPECT_EQ(first.substr(16), " 2") << "the last tenth of the steps";
    EXPECT_EQ(hashOf(""), first);
    EXPECT_NE(hashOf("--dt 0.01"), first);
    EXPECT_EQ(runProgram("bench world --scene file --steps 10").code, 2);
    EXPECT_EQ(runProgram("bench world --scene drop --mesh /nowhere/a.obj").code, 3);
}

constexpr const char* kParts = "stock,broadphase,dispatcher,world,broadphase+dispatcher,all";

/// World of a row, with the threads.
std::string worldOf(const json& row)
{
    return row["parts"].get<std::string>() + " " + std::to_string(row["threads"].get<int>());
}

TEST_F(BenchWorldCommand, MeasuresEverySceneWithEveryPartInEveryWindow)
{
    Outcome outcome;
    const json document = runForJson(
        std::string(
            "bench world --scene boxes,hulls,free-hulls,pyramid,wall,ragdolls,terrain,statics,convex-mesh "
            "--bodies 40 --steps 40 --falling 5:8 --settled 30:33 --sleeping 37:40 "
            "--windows falling,settled,sleeping,all --threads 1,2,3 --parts ") +
            kParts,
        &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    const std::set<std::string> worlds = {"stock 1",
                                          "broadphase 1",
                                          "broadphase 2",
                                          "broadphase 3",
                                          "dispatcher 1",
                                          "dispatcher 2",
                                          "dispatcher 3",
                                          "world 1",
                                          "world 2",
                                          "world 3",
                                          "broadphase+dispatcher 1",
                                          "broadphase+dispatcher 2",
                                          "broadphase+dispatcher 3",
                                          "all 1",
                                          "all 2",
                                          "all 3"};
    std::map<std::string, std::set<std::string>> measured;
    std::map<std::tuple<std::string, std::string, std::string>, std::set<std::string>> hashes;
    for (const json& row : document["rows"])
    {
        const std::string where = row["scene"].get<std::string>() + " " + row["benchmark"].get<std::string>();
        EXPECT_TRUE(measured[where].insert(worldOf(row)).second)
            << where << " has " << worldOf(row) << " twice";
        const std::string parts = row["parts"];
        const std::string pairs = parts == "all" || contains(parts, "broadphase") ? "cullet" : "Bullet";
        const std::string contacts = parts == "all" || contains(parts, "dispatcher") ? "cullet" : "Bullet";
        hashes[{where, pairs, contacts}].insert(row["hash"].get<std::string>() + row["pairs"].dump());
    }
    EXPECT_EQ(measured.size(), 9u * 4u * 9u) << "scenes, windows, phases";
    for (const auto& [where, found] : measured)
        EXPECT_EQ(found, worlds) << where;
    for (const auto& [question, found] : hashes)
        EXPECT_EQ(found.size(), 1u) << std::get<0>(question) << ": threads or cullet::World change the bits";
    EXPECT_GT(hashes.size(), 9u * 4u * 9u) << "the hash tells no part from another";
    EXPECT_TRUE(contains(outcome.output, "convex-mesh, all: steps 0 to 40, median ms")) << outcome.output;
}

TEST_F(BenchWorldCommand, FindsEqualBitsOfWorldsThatAreLargeEnoughForThreads)
{
    Outcome outcome;
    const json document = runForJson(
        "bench world --scene ragdolls,hulls --bodies 2200 --steps 30 --windows all --threads 1,2,3 --parts "
        "stock,world,all",
        &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    EXPECT_EQ(expectOneHashFor({"scene", "narrow"}, document["rows"]), 4u);
}

TEST_F(BenchWorldCommand, LetsBodiesSleepInTheirOwnWindowOnly)
{
    const json document = runForJson(
        "bench world --scene pyramid --bodies 21 --steps 260 --windows settled,sleeping --parts "
        "stock,world,all "
        "--threads 1");
    ASSERT_EQ(document["rows"].size(), 2u * 3u * 9u);
    for (const json& row : document["rows"])
    {
        const bool mayRest = contains(row["benchmark"].get<std::string>(), ".sleeping");
        EXPECT_EQ(row["sleepers"], mayRest ? 21 : 0) << row.dump();
        EXPECT_EQ(row["energy_j"] == 0.0, mayRest) << row.dump();
        EXPECT_GT(row["depth_max_mm"], 0.0) << row.dump();
        EXPECT_LT(row["depth_max_mm"], 100.0) << row.dump();
        EXPECT_LT(row["overlap_max_mm"], 100.0) << row.dump();
        for (const std::string depth : {"depth", "overlap"})
        {
            EXPECT_GT(row[depth + "_mean_mm"], 0.0) << row.dump();
            EXPECT_LE(row[depth + "_mean_mm"], row[depth + "_p99_mm"]);
            EXPECT_LE(row[depth + "_p99_mm"], row[depth + "_max_mm"]);
        }
        EXPECT_EQ(row["steps_to_sleep"] > 0, mayRest) << row.dump();
        EXPECT_LE(row["steps_to_sleep"], 260) << row.dump();
        if (!mayRest)
        {
            EXPECT_GT(row["drift_mm"], 0.0) << row.dump();
        }
        EXPECT_LT(row["drift_mm"], 50) << row.dump();
        EXPECT_EQ(row["joint_max_mm"], 0) << row.dump();
    }
}

TEST_F(BenchWorldCommand, MeasuresErrorsOfJoints)
{
    const json document = runForJson(
        "bench world --scene ragdolls --bodies 55 --steps 30 --windows falling --parts all --threads 1 "
        "--solver "
        "bullet,cullet,cullet-soft");
    ASSERT_EQ(document["rows"].size(), 3u * 9u);
    for (const json& row : document["rows"])
    {
        EXPECT_GT(row["joint_mean_mm"], 0.0) << row.dump();
        EXPECT_LE(row["joint_mean_mm"], row["joint_max_mm"]) << row.dump();
        EXPECT_LT(row["joint_max_mm"], 200.0) << row.dump();
        EXPECT_EQ(row["steps_to_sleep"], -1) << row.dump();
    }
}

TEST_F(BenchWorldCommand, WritesTheColumnsThatAreDocumented)
{
    const std::string path = temporaryPath("world.csv");
    ASSERT_EQ(
        runProgram("bench world --scene whole-step --bodies 12 --steps 10 --parts stock --csv " + path).code,
        0);
    std::istringstream lines(readText(path));
    std::remove(path.c_str());
    std::string head, line;
    std::getline(lines, head);
    EXPECT_EQ(
        head,
        "benchmark,scene,backend,narrow,update,precision,threads,bodies,pairs,median_ms,p90_ms,min_ms,hash,"
        "mean_ms,contact_pairs,steps,parts,depth_mean_mm,depth_p99_mm,depth_max_mm,overlap_mean_mm,overlap_"
        "p99_mm,overlap_max_mm,energy_j,sleepers,"
        "steps_to_sleep,drift_mm,joint_mean_mm,joint_max_mm,solver,reuse_mm,cpu,gpu,commit,machine");
    std::set<std::string> scenes;
    for (; std::getline(lines, line);)
        scenes.insert(
            line.substr(line.find(',') + 1, line.find(',', line.find(',') + 1) - line.find(',') - 1));
    EXPECT_EQ(scenes, (std::set<std::string>{"boxes", "hulls", "free-hulls", "pyramid", "wall", "ragdolls",
                                             "terrain", "statics"}));
}

TEST_F(BenchWorldCommand, ExplainsOptionsThatDoNotFit)
{
    const std::pair<const char*, const char*> wrong[] = {
        {"--parts octree", "unknown part 'octree'; known: stock, broadphase, dispatcher, world"},
        {"--parts broadphase+stock", "unknown part 'stock'"},
        {"--parts all --narrow bullet", "--parts excludes --narrow"},
        {"--parts all --backend grid,dbvt", "--parts takes one --backend"},
        {"--parts all --backend octree", "unknown backend 'octree'"},
        {"--sleeping 3:5", "'sleeping' is not among --windows"},
        {"--windows sleeping --sleeping 5:3", "FIRST:END with FIRST < END"},
        {"--windows resting", "resting"},
        {"--scene boxes,lottery", "unknown scene 'lottery'; known: drop"},
        {"--threads -1", "-1"},
    };
    for (const auto& [options, message] : wrong)
    {
        const Outcome outcome = runProgram(std::string("bench world --bodies 5 --steps 10 ") + options);
        EXPECT_EQ(outcome.code, kExitUsage) << options << outcome.errors;
        EXPECT_TRUE(contains(outcome.errors, message)) << options << ": " << outcome.errors;
    }
}

TEST_F(BenchWorldCommand, LeavesOutBulletsMultithreadedWorldWhereItIsMissing)
{
    Outcome outcome;
    const std::string options = "bench world --scene boxes --bodies 200 --steps 30 --threads 1,2 --parts ";
    const json document = runForJson(options + "stock,mt", &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    std::set<std::string> worlds;
    for (const json& row : document["rows"])
        worlds.insert(worldOf(row));
    const Outcome alone = runProgram(options + "mt");
    if (!contains(outcome.errors, "left out: mt"))
    {
        EXPECT_EQ(worlds, (std::set<std::string>{"stock 1", "mt 1", "mt 2"})) << outcome.errors;
        EXPECT_EQ(alone.code, 0) << alone.errors;
        return;
    }
    EXPECT_EQ(worlds, std::set<std::string>{"stock 1"});
    EXPECT_EQ(alone.code, kExitUnavailable);
    EXPECT_TRUE(
        contains(alone.errors, "built without BT_THREADSAFE; configure with -DCULLET_THREADSAFE_BULLET"))
        << alone.errors;
}
}  // namespace
}  // namespace cullet
