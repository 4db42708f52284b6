// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/demos/program.h"

#include <cstdint>
#include <set>

namespace cullet
{
namespace
{
using nlohmann::json;

/// A debug build refuses to measure.
class BenchLossesCommand : public testing::Test
{
protected:
    void SetUp() override
    {
#ifndef NDEBUG
        GTEST_SKIP() << "a debug build refuses to measure, as it should";
#endif
    }
};

void expectVerdict(const json& row)
{
    const std::string measure = row["measure"].get<std::string>();
    const std::string against = row.contains("dbvt_ms")         ? "dbvt"
                                : row.contains("broadphase_ms") ? "broadphase"
                                                                : "bullet";
    const double ratio = row[measure == "memory" ? "memory_ratio" : against + "_ratio"].get<double>();
    EXPECT_GT(ratio, 0.0) << row.dump();
    EXPECT_EQ(row["met"].get<bool>(), ratio <= row["target"].get<double>()) << row.dump();
}

TEST_F(BenchLossesCommand, ComparesEveryCaseWithBruteForceAndWithWhatCulletReplaces)
{
    Outcome outcome;
    const json document =
        runForJson("bench losses --precision double --scale 0.02 --rounds 2 --budget 600", &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    std::set<std::string> names, measures;
    for (const json& row : document["rows"])
    {
        names.insert(row["scene"].get<std::string>());
        measures.insert(row["measure"].get<std::string>());
        expectVerdict(row);
        EXPECT_EQ(row["rounds"], 2) << row.dump();
        EXPECT_EQ(row["checks"], row.contains("dbvt-deferred_ms") ? 6 : 4) << row.dump();
        EXPECT_GT(row["median_ms"], 0.0) << row.dump();
    }
    EXPECT_EQ(names.size(), document["rows"].size());
    EXPECT_GE(names.size(), 25u);
    EXPECT_EQ(measures, (std::set<std::string>{"memory", "time"}));
}

TEST_F(BenchLossesCommand, FindsOverlapsInCasesThatAreAboutPairs)
{
    const json document = runForJson("bench losses --case ghosts,spot,heap,wall --scale 0.05 --rounds 2");
    ASSERT_EQ(document["rows"].size(), 4u);
    for (const json& row : document["rows"])
    {
        // Bodies at one spot have moved apart at the end.
        EXPECT_EQ(row["pairs"].get<std::uint64_t>() > 0, row["scene"] != "spot") << row.dump();
    }
}

TEST_F(BenchLossesCommand, GivesEachCaseSeveralRoundsWhateverTheyCost)
{
    const json document = runForJson("bench losses --case tiny,spot --scale 0.05 --rounds 9 --budget 0");
    ASSERT_EQ(document["rows"].size(), 2u);
    for (const json& row : document["rows"])
        EXPECT_EQ(row["rounds"], 5) << row.dump();
    EXPECT_EQ(runForJson("bench losses --case tiny --rounds 3 --budget 0")["rows"][0]["rounds"], 3);
}

TEST_F(BenchLossesCommand, LeavesOutCasesOfDoublePrecisionAndRefusesUnknownOnes)
{
    Outcome outcome;
    const json document =
        runForJson("bench losses --case far,tiny,construction --scale 0.5 --rounds 1", &outcome);
    EXPECT_EQ(outcome.code, 0) << outcome.errors;
    EXPECT_TRUE(contains(outcome.errors, "far needs --precision double")) << outcome.errors;
    ASSERT_EQ(document["rows"].size(), 2u);
    EXPECT_EQ(document["rows"][0]["scene"], "tiny");
    EXPECT_EQ(document["rows"][1]["bodies"], 50);
    const Outcome unknown = runProgram("bench losses --case tiny,nothing");
    EXPECT_EQ(unknown.code, 2);
    EXPECT_TRUE(contains(unknown.errors, "unknown case 'nothing'")) << unknown.errors;
    EXPECT_EQ(runProgram("bench losses --scale 2").code, 2);
}
}  // namespace
}  // namespace cullet
