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
class BenchMeshCommand : public testing::Test
{
protected:
    void SetUp() override
    {
#ifndef NDEBUG
        EXPECT_EQ(runProgram("bench mesh").code, 5);
        GTEST_SKIP() << "a debug build refuses to measure, as it should";
#endif
    }
};

TEST_F(BenchMeshCommand, MeasuresEveryShapeOnEveryMeshInEveryMotion)
{
    Outcome outcome;
    const json document = runForJson(
        "bench mesh --bodies 4 --steps 4 --mesh 0.5m,5m,heightfield,scaled,multi-material,flat", &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    ASSERT_EQ(document["rows"].size(), 10u * 6u * 3u * 3u);
    std::set<std::string> cases;
    for (const json& row : document["rows"])
    {
        cases.insert(row["shape"].get<std::string>() + row["scene"].get<std::string>() +
                     row["benchmark"].get<std::string>() + row["backend"].get<std::string>());
        EXPECT_GT(row["us_per_body"], 0.0);
        EXPECT_GE(row["step_us_per_body"], row["us_per_body"]);
        EXPECT_GT(row["first_over_this"], 0.0);
        EXPECT_EQ(row["steps"], 4);
        EXPECT_EQ(row["bodies"], 4);
        // A body that falls may still be above the mesh.
        if (row["benchmark"] != "mesh.falling")
        {
            EXPECT_EQ(row["pairs"], 4) << row.dump();
            EXPECT_GT(row["triangles_per_body"], 0.9) << row.dump();
        }
    }
    EXPECT_EQ(cases.size(), document["rows"].size());
}

TEST_F(BenchMeshCommand, StepsWorldsOfOneCaseAlike)
{
    // With the same narrow phase, the same bits.
    const json document =
        runForJson("bench mesh --shape box,hull16 --mesh flat --narrow bullet,bullet --bodies 4 --steps 30");
    ASSERT_EQ(document["rows"].size(), 2u * 3u * 2u);
    std::map<std::string, std::set<std::string>> hashes;
    for (const json& row : document["rows"])
        hashes[row["shape"].get<std::string>() + row["benchmark"].get<std::string>()].insert(
            row["hash"].get<std::string>());
    for (const auto& [which, found] : hashes)
        EXPECT_EQ(found.size(), 1u) << which;
    EXPECT_EQ(hashes.size(), 6u);
}

TEST_F(BenchMeshCommand, WritesQualityOfEveryTrial)
{
    Outcome outcome;
    const json document = runForJson("bench mesh --quality --narrow bullet,isa-gjk", &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    std::map<std::string, int> counts;
    for (const json& row : document["rows"])
    {
        EXPECT_EQ(row["benchmark"], "mesh.quality");
        ++counts[row["trial"].get<std::string>() + " " + row["backend"].get<std::string>()];
        EXPECT_GE(row["jump"], 0.0);
        EXPECT_LE(row["fallen"], row["bodies"]);
        EXPECT_LE(row["jumped"], row["bodies"]);
    }
    EXPECT_EQ(counts["slide bullet"], 13);
    EXPECT_EQ(counts["slide isa-gjk"], 13);
    EXPECT_EQ(counts["shot bullet"], 12);
    EXPECT_EQ(counts["shot isa-gjk"], 12);
}

TEST_F(BenchMeshCommand, AnswersUnknownNames)
{
    for (const std::string option : {"--shape teapot", "--mesh lawn", "--motion flying", "--narrow gilbert"})
    {
        const Outcome outcome = runProgram("bench mesh " + option);
        EXPECT_EQ(outcome.code, 2) << option;
        EXPECT_TRUE(contains(outcome.errors, option.substr(0, option.find(' ')))) << outcome.errors;
    }
}
}  // namespace
}  // namespace cullet
