// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/demos/program.h"

#include <set>

namespace cullet
{
namespace
{
using nlohmann::json;

/// A debug build refuses to measure, so little can be tested in it.
class BenchCompoundsCommand : public testing::Test
{
protected:
    void SetUp() override
    {
#ifndef NDEBUG
        EXPECT_EQ(runProgram("bench compounds").code, 5);
        GTEST_SKIP() << "a debug build refuses to measure, as it should";
#endif
    }
};

TEST_F(BenchCompoundsCommand, MeasuresEveryChildAndOtherInEveryMotion)
{
    Outcome outcome;
    const json document = runForJson("bench compounds --children 2,8 --rounds 1", &outcome);
    ASSERT_EQ(outcome.code, 0) << outcome.output << outcome.errors;
    std::set<std::string> rows;
    for (const json& row : document["rows"])
    {
        rows.insert(row["shape"].get<std::string>() + row["scene"].get<std::string>() +
                    row["benchmark"].get<std::string>() + row["backend"].get<std::string>() +
                    std::to_string(row["children"].get<int>()));
        EXPECT_GT(row["us_per_body"], 0.0);
        EXPECT_GT(row["first_over_this"], 0.0);
        // A child that falls may still be above the ground.
        if (row["benchmark"] == "compounds.rest")
        {
            EXPECT_GT(row["contacts_per_body"], 0.9) << row.dump();
            EXPECT_GT(row["manifolds_per_body"], 0.9) << row.dump();
        }
    }
    EXPECT_EQ(rows.size(), 3u * 7u * 3u * 2u * 2u);
    EXPECT_EQ(document["rows"].size(), rows.size());
}

TEST_F(BenchCompoundsCommand, AnswersUnknownNames)
{
    for (const std::string option :
         {"--child teapot", "--other lawn", "--motion flying", "--narrow gilbert", "--children 1"})
    {
        const Outcome outcome = runProgram("bench compounds " + option);
        EXPECT_EQ(outcome.code, 2) << option;
        EXPECT_TRUE(contains(outcome.errors, option.substr(0, option.find(' ')))) << outcome.errors;
    }
}
}  // namespace
}  // namespace cullet
