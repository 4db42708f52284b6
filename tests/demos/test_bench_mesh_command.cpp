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

/// Expects a row with every narrow phase for every one of some cases of 4 bodies and 4 steps.
void expectRows(const std::string& arguments, std::size_t cases)
{
    Outcome outcome;
    const json document = runForJson("bench mesh --bodies 4 --steps 4 " + arguments, &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    std::set<std::string> rows;
    for (const json& row : document["rows"])
    {
        rows.insert(row["shape"].get<std::string>() + row["scene"].get<std::string>() +
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
    EXPECT_EQ(rows.size(), 3 * cases);
    EXPECT_EQ(document["rows"].size(), 3 * cases);
}

TEST_F(BenchMeshCommand, MeasuresEveryShapeInEveryMotion)
{
    expectRows("--mesh 5m", 10 * 3);
}

TEST_F(BenchMeshCommand, MeasuresEveryMesh)
{
    expectRows("--shape box --motion rest --mesh 0.5m,0.1m,5m,heightfield,scaled,multi-material,flat", 7);
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
    const json document = runForJson("bench mesh --quality --narrow bullet", &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    std::map<std::string, int> counts;
    for (const json& row : document["rows"])
    {
        EXPECT_EQ(row["benchmark"], "mesh.quality");
        EXPECT_EQ(row["backend"], "bullet");
        ++counts[row["trial"].get<std::string>()];
        EXPECT_GE(row["jump"], row["mean_jump"]);
        EXPECT_LE(row["fallen"], row["bodies"]);
        EXPECT_LE(row["jumped"], row["bodies"]);
    }
    EXPECT_EQ(counts["slide"], 13);
    EXPECT_EQ(counts["shot"], 12);
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
