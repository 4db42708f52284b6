// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/demos/program.h"

#include <map>
#include <set>

namespace cullet
{
namespace
{
using nlohmann::json;

/// A debug build refuses to measure, so little can be tested in it.
class BenchCommand : public testing::Test
{
protected:
    void SetUp() override
    {
#ifndef NDEBUG
        const Outcome outcome = runProgram("bench broad --bodies 10");
        EXPECT_EQ(outcome.code, 5);
        EXPECT_TRUE(contains(outcome.errors, "debug build")) << outcome.errors;
        GTEST_SKIP() << "a debug build refuses to measure, as it should";
#endif
    }
};

void expectColumns(const json& row)
{
    for (const char* column : {"benchmark", "scene", "backend", "precision", "threads", "bodies", "pairs",
                               "median_ms", "p90_ms", "min_ms", "hash"})
        EXPECT_TRUE(row.contains(column)) << column << " is missing in " << row.dump();
    EXPECT_GT(row["median_ms"], 0.0);
    EXPECT_LE(row["min_ms"], row["median_ms"]);
    EXPECT_LE(row["median_ms"], row["p90_ms"]);
}

TEST_F(BenchCommand, FindsExactPairsWithManyBackendsInManyScenes)
{
    Outcome outcome;
    const json document = runForJson(
        "bench broad --scene W1,W2,W3,W3b,W3fresh,W4,W5,pile,static,cell,line,diagonal,point,cover,decades "
        "--bodies 300 "
        "--backend grid,grid-cells,brute,dbvt,dbvt-deferred,dbvt-m0,axissweep --frames 3 "
        "--warmup 1",
        &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    ASSERT_EQ(document["rows"].size(), 15u * 7u);
    for (const json& row : document["rows"])
    {
        expectColumns(row);
        EXPECT_GT(row["pairs"], 0);
        EXPECT_GE(row["held_pairs"], row["pairs"]);
        EXPECT_EQ(row["checked_against"], "exact");
        EXPECT_EQ(row["checks"], 3);
        EXPECT_EQ(row["frames"], 3);
    }
    expectOneHashFor({"scene"}, document["rows"]);
}

TEST_F(BenchCommand, FindsSamePairsWithEveryAblationBackendAndCountsTests)
{
    const json document = runForJson(
        "bench broad --scene settle --bodies 300 --backend ablation --frames 3 --warmup 1 --per-frame");
    std::set<std::string> hashes;
    std::map<std::string, int> frames;
    for (const json& row : document["rows"])
    {
        if (row["benchmark"] == "broad.frame")
        {
            ++frames[row["backend"].get<std::string>()];
            continue;
        }
        expectColumns(row);
        hashes.insert(row["hash"].get<std::string>());
        EXPECT_GT(row["tests"], 0) << row.dump();
        if (row["backend"] == "sap")
        {
            EXPECT_GT(row["swaps_y"], row["swaps_x"]);
        }
    }
    EXPECT_EQ(hashes.size(), 1u);
    EXPECT_GT(frames.size(), 20u);
    for (const auto& [backend, count] : frames)
        EXPECT_EQ(count, 3) << backend;
}

TEST_F(BenchCommand, ComparesExtremeScenesWithBalancedOnesOfAsManyPairs)
{
    Outcome outcome;
    const json document = runForJson(
        "bench broad --scene extremes --bodies 4000 --backend grid,grid-cells,psap --frames 3 --warmup 2 "
        "--threads 1",
        &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    ASSERT_EQ(document["rows"].size(), 6u * 2u * 3u);
    std::map<std::string, double> pairs;
    for (const json& row : document["rows"])
    {
        expectColumns(row);
        EXPECT_EQ(row["checked_against"], "exact");
        EXPECT_EQ(row["checks"], 3);
        pairs[row["scene"]] = row["pairs"];
        const bool isBalanced = contains(row["scene"].get<std::string>(), "-balanced");
        EXPECT_EQ(row.contains("cpu_ratio"), !isBalanced);
        if (!isBalanced)
        {
            EXPECT_GT(row["cpu_ratio"], 0.0);
            EXPECT_GT(row["wall_ratio"], 0.0);
        }
    }
    for (const char* scene : {"cell", "line", "diagonal", "point", "cover", "decades"})
        EXPECT_NEAR(pairs[std::string(scene) + "-balanced"] / pairs[scene], 1.0, 0.1) << scene;
}

TEST_F(BenchCommand, HoldsOnlyOverlappingPairsWhenMarginIsZero)
{
    for (const std::string margin : {"0", "0.5"})
    {
        const json document = runForJson(
            "bench broad --scene W1 --bodies 600 --backend grid,psap --frames 3 --margin " + margin);
        ASSERT_EQ(document["rows"].size(), 2u);
        for (const json& row : document["rows"])
            EXPECT_EQ(row["held_pairs"] == row["pairs"], margin == "0") << row.dump();
    }
}

TEST_F(BenchCommand, FindsSamePairsWithOtherLibrariesOrNamesMissingOnes)
{
    Outcome outcome;
    const json document = runForJson(
        "bench broad --scene W1,W2,W5 --bodies 300 --backend grid,rivals --frames 3 --warmup 1", &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    std::set<std::string> measured;
    for (const json& row : document["rows"])
    {
        expectColumns(row);
        EXPECT_EQ(row["wrong_checks"], 0) << row.dump();
        EXPECT_GT(row["pairs"], 0);
        measured.insert(row["backend"].get<std::string>());
    }
    expectOneHashFor({"scene"}, document["rows"]);
    for (const char* rival : {"fcl-tree", "coal-tree", "ode-hash", "cgal", "embree"})
    {
        if (measured.count(rival) != 0)
            continue;
        EXPECT_TRUE(contains(outcome.errors, std::string("without ") + rival + ": install "))
            << outcome.errors;
        const Outcome refused = runProgram(std::string("bench broad --bodies 10 --backend ") + rival);
        EXPECT_EQ(refused.code, 5);
        EXPECT_TRUE(contains(refused.errors, "built without it")) << refused.errors;
    }
}

TEST_F(BenchCommand, MeasuresThroughBulletInBothPrecisionsWithTheSamePairs)
{
    std::set<std::string> hashes;
    for (const std::string precision : {"float", "double"})
    {
        const json document = runForJson(
            "bench broad --bodies 200 --backend grid,dbvt --frames 3 --warmup 1 "
            "--through bullet --ids random --precision " +
            precision);
        ASSERT_EQ(document["rows"].size(), 2u);
        for (const json& row : document["rows"])
        {
            EXPECT_EQ(row["through"], "bullet");
            EXPECT_EQ(row["precision"], precision);
            hashes.insert(row["hash"].get<std::string>());
        }
    }
    EXPECT_EQ(hashes.size(), 1u);
}

TEST_F(BenchCommand, MeasuresEverySizeWithEveryIdOrder)
{
    const json document = runForJson(
        "bench broad --bodies 100,200 --ids random,sorted --backend grid --frames 3 --warmup 0 --threads 1");
    ASSERT_EQ(document["rows"].size(), 4u);
    std::set<std::string> cases;
    for (const json& row : document["rows"])
    {
        EXPECT_EQ(row["threads"], 1);
        cases.insert(row["ids"].get<std::string>() + std::to_string(row["bodies"].get<int>()));
    }
    EXPECT_EQ(cases.size(), 4u);
}

TEST_F(BenchCommand, CutsAWarmUpAndAFrameCountThatExceedTheBudget)
{
    const json document =
        runForJson("bench broad --bodies 500 --backend brute,grid --frames 40 --warmup 20 --budget 0.000001");
    for (const json& row : document["rows"])
    {
        EXPECT_EQ(row["frames"], 3);
        EXPECT_EQ(row["warmup_frames"], 1);
        EXPECT_GE(row["checks"], 2);
    }
}

TEST_F(BenchCommand, FindsSamePairsWhenUnmovedBoxesAreSentAgain)
{
    std::set<std::string> hashes;
    for (const char* resend : {"0", "1"})
    {
        const json document =
            runForJson(std::string("bench broad --scene static --bodies 400 --backend grid,dbvt "
                                   "--through bullet --frames 3 --resend ") +
                       resend);
        for (const json& row : document["rows"])
            hashes.insert(row["hash"].get<std::string>());
    }
    EXPECT_EQ(hashes.size(), 1u);
}

TEST_F(BenchCommand, MeasuresCreateSpotAndRemoveEvents)
{
    Outcome outcome;
    const json document = runForJson(
        "bench broad --scene create,spot,remove --bodies 200 --backend grid,dbvt --through bullet", &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    std::map<std::string, std::set<std::uint64_t>> pairs;
    for (const json& row : document["rows"])
    {
        expectColumns(row);
        EXPECT_EQ(row["finished"], true);
        pairs[row["benchmark"]].insert(row["pairs"].get<std::uint64_t>());
    }
    EXPECT_EQ(pairs["broad.create"], std::set<std::uint64_t>{199});
    EXPECT_EQ(pairs["broad.spot"], std::set<std::uint64_t>{0});
    EXPECT_EQ(pairs["broad.spot.together"], std::set<std::uint64_t>{0});
    EXPECT_EQ(pairs["broad.remove"].size(), 1u);
}

TEST_F(BenchCommand, StopsAnEventAtItsDeadline)
{
    const json document =
        runForJson("bench broad --scene create --bodies 20000 --backend dbvt --budget 0.05");
    ASSERT_EQ(document["rows"].size(), 1u);
    EXPECT_EQ(document["rows"][0]["finished"], false);
    EXPECT_LT(document["rows"][0]["bodies_done"], 20000);
}

TEST_F(BenchCommand, HitsSameBodiesInQueriesOfGridAndDbvt)
{
    Outcome outcome;
    const json document =
        runForJson("bench broad --scene queries --bodies 400 --backend grid,dbvt --queries 300", &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    ASSERT_EQ(document["rows"].size(), 12u) << "rays, boxes and sweeps, at rest and moving, two backends";
    for (const json& row : document["rows"])
    {
        EXPECT_GT(row["hits"], 0) << row.dump();
        EXPECT_GE(row["reported"], row["hits"]);
    }
    EXPECT_EQ(expectOneHashFor({"benchmark", "scene"}, document["rows"]), 6u);
}

TEST_F(BenchCommand, TracesTheFramesOfEachBackend)
{
    const std::string path = temporaryPath("broad.json");
    const Outcome outcome =
        runProgram("bench broad --bodies 100,200 --backend grid,dbvt --steps 3 --warmup 1 --trace " + path);
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    const json trace = json::parse(readText(path), nullptr, false);
    std::remove(path.c_str());
    std::map<std::string, int> counts = countSpans(trace);
    EXPECT_EQ(counts["dbvt, W1 of 200"], 1);
    for (const std::string lane : {"1", "2", "3", "4"})
    {
        EXPECT_EQ(counts["setBoxes " + lane], 4) << "one to warm up, three timed";
        EXPECT_EQ(counts["findPairs " + lane], 4);
    }
}

TEST_F(BenchCommand, TracesEventsAndQueries)
{
    const std::string path = temporaryPath("events.json");
    const Outcome outcome = runProgram(
        "bench broad --scene remove,queries --bodies 200 --backend grid --queries 10 --trace " + path);
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    std::map<std::string, int> counts = countSpans(json::parse(readText(path), nullptr, false));
    std::remove(path.c_str());
    EXPECT_EQ(counts["broad.remove 1"], 5) << "trials";
    for (const std::string kind : {"ray", "aabb", "sweep"})
    {
        EXPECT_EQ(counts["broad.queries." + kind + " 2"], 9) << "at rest";
        EXPECT_EQ(counts["broad.queries." + kind + " 3"], 9) << "moving";
    }
    EXPECT_EQ(counts["update 3"], 27);
}

TEST_F(BenchCommand, MeasuresNarrowQueriesAndChecksTheirAnswers)
{
    Outcome outcome;
    const json document = runForJson(
        "bench narrow --shape box8,ico12 --regime separated,overlapping --query "
        "boolean,distance,contacts,algorithm,dispatcher,still --repetitions 1",
        &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    int rowCount = 0, meanCount = 0;
    for (const json& row : document["rows"])
    {
        const bool isMean = row["scene"] == "regular";
        ++(isMean ? meanCount : rowCount);
        EXPECT_GT(row["ns_per_query"], 0.0);
        EXPECT_GT(row["bullet_over_this"], 0.0);
        if (isMean || row["backend"] != "cullet")
            continue;
        expectColumns(row);
        EXPECT_TRUE(contains(outcome.output, row["hash"].get<std::string>())) << "in the table too";
        EXPECT_EQ(row["wrong"], 0) << row.dump();
        EXPECT_LT(row["max_error"], 2e-7) << row.dump();
        // Separated with a cached axis: exactly two supports.
        if (row["temperature"] == "warm" && row["regime"] == "separated" &&
            row["benchmark"] == "narrow.boolean")
        {
            EXPECT_LT(row["iterations"], 0.2);
            EXPECT_NEAR(row["supports"].get<double>(), 2.0, 0.5);
        }
    }
    // Two shapes, two regimes, four queries; cullet warm and cold, and Bullet. Two more through a dispatcher, warm
    // only.
    EXPECT_EQ(rowCount, 2 * 2 * (4 * 3 + 2 * 2));
    EXPECT_EQ(meanCount, 2 * (4 * 3 + 2 * 2));
    EXPECT_EQ(runProgram("bench narrow --shape sphere").code, 2);
}

TEST_F(BenchCommand, LeavesOutLibrariesThatTheProgramWasBuiltWithout)
{
    const std::string narrow =
        "bench narrow --shape box8 --regime separated --query boolean --repetitions 1 ";
    Outcome outcome;
    const json document = runForJson(narrow + "--algorithm cullet,bullet,ccd,fcl,coal", &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    std::set<std::string> measured;
    for (const json& row : document["rows"])
        measured.insert(row["backend"].get<std::string>());
    EXPECT_EQ(measured.count("cullet") + measured.count("bullet"), 2u);
    for (const std::string library : {"ccd", "fcl", "coal"})
    {
        const bool isThere = measured.count(library) != 0;
        EXPECT_NE(contains(outcome.errors, library + ": built without"), isThere) << outcome.errors;
        const Outcome alone = runProgram(narrow + "--algorithm " + library + "," + library);
        EXPECT_EQ(alone.code, isThere ? 0 : 5) << alone.errors;
    }
}

TEST_F(BenchCommand, MeasuresOtherStartsAndSolversOfNarrowQueries)
{
    Outcome outcome;
    const json document = runForJson(
        "bench narrow --shape ico12 --regime near,overlapping --query boolean,distance,simplex --algorithm "
        "cullet,cullet-axis,cullet-four,voronoi,voronoi-full,johnson,signed-volumes --repetitions 1",
        &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    std::map<std::string, int> counts;
    for (const json& row : document["rows"])
    {
        expectColumns(row);
        EXPECT_EQ(row["wrong"], 0) << row.dump();
        EXPECT_GT(row["ns_per_query"], 0.0);
        EXPECT_GE(row["iterations"], 0.0);
        ++counts[row["backend"]];
        // Four of each shape before the first simplex; another one to prove that the last simplex is the closest.
        if (row["backend"] == "cullet-four" && row["regime"] == "near" &&
            row["benchmark"] == "narrow.distance")
        {
            EXPECT_GE(row["supports"], 10.0);
        }
    }
    const std::map<std::string, int> expected = {
        {"cullet", 8},       {"cullet-axis", 8}, {"cullet-four", 4},   {"voronoi", 2},
        {"voronoi-full", 2}, {"johnson", 2},     {"signed-volumes", 2}};
    EXPECT_EQ(counts, expected);
}

TEST_F(BenchCommand, MeasuresConvexPairsOnDeviceOrSaysWhyNot)
{
    Outcome outcome;
    const json document = runForJson("bench narrow --device --most-pairs 100000", &outcome);
    if (outcome.code == 0)
    {
        ASSERT_EQ(document["rows"].size(), 6u);
        EXPECT_EQ(document["rows"][0]["overlapping"], 5000);
        EXPECT_EQ(document["rows"][5]["overlapping"], 100000);
        EXPECT_EQ(document["rows"][5]["query"], "contacts");
        for (const json& row : document["rows"])
            EXPECT_GT(row["warm_ms"], 0.0);
        return;
    }
    EXPECT_EQ(outcome.code, 5);
    EXPECT_TRUE(contains(outcome.errors, "CUDA") || contains(outcome.errors, "NVIDIA")) << outcome.errors;
}

TEST_F(BenchCommand, MeasuresCudaOrSaysWhyNot)
{
    Outcome outcome;
    const json document = runForJson("bench cuda --only nothing", &outcome);
    if (outcome.code == 0)
    {
        ASSERT_EQ(document["rows"].size(), 2u);
        for (const json& row : document["rows"])
        {
            EXPECT_EQ(row["scene"], "copy");
            EXPECT_GT(row["gpu_ms"], 0.0);
        }
        return;
    }
    EXPECT_EQ(outcome.code, 5);
    EXPECT_TRUE(contains(outcome.errors, "CUDA") || contains(outcome.errors, "NVIDIA")) << outcome.errors;
}

TEST_F(BenchCommand, WritesResultsSoFarWhenInterrupted)
{
    const std::string path = temporaryPath("interrupted.json");
    for (const std::string bench :
         {"narrow --shape box8 --regime separated --query boolean --repetitions 100000",
          "world --scene boxes --bodies 50 --steps 100000000 --falling 2:5",
          "broad --bodies 100 --backend grid,dbvt --warmup 1 --frames 1000000 --budget 1000"})
    {
        const Outcome outcome = runShell("timeout --preserve-status -s INT 2 " + std::string(CULLET_PROGRAM) +
                                         " bench " + bench + " --json " + path);
        EXPECT_EQ(outcome.code, 130) << bench << outcome.errors;
        const json document = json::parse(readText(path), nullptr, false);
        ASSERT_TRUE(document.is_object()) << bench;
        EXPECT_GE(document["rows"].size(), 2u) << bench;
    }
    std::remove(path.c_str());
}

TEST_F(BenchCommand, AnswersUnknownNamesWithKnownOnes)
{
    const Outcome scene = runProgram("bench broad --scene W6");
    EXPECT_EQ(scene.code, 2);
    EXPECT_TRUE(contains(scene.errors, "unknown scene 'W6'; known: W1, W2")) << scene.errors;
    const Outcome backend = runProgram("bench broad --backend octree");
    EXPECT_EQ(backend.code, 2);
    EXPECT_TRUE(contains(backend.errors, "unknown backend 'octree'; known: grid")) << backend.errors;
}
}  // namespace
}  // namespace cullet
