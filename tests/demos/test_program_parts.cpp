// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/bench_cases.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/files/hash_check.h"
#include "cullet/demos/program/files/result_file.h"
#include "cullet/demos/program/progress.h"
#include "cullet/demos/program/speed_sentence.h"
#include "cullet/demos/program/statistics.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace cullet
{
namespace
{
TEST(Statistics, GiveMedianPercentileAndMeanOfKnownSamples)
{
    const Statistics ten = summarise({10, 9, 8, 7, 6, 5, 4, 3, 2, 1});
    EXPECT_DOUBLE_EQ(ten.median, 5.5);
    EXPECT_DOUBLE_EQ(ten.p90, 9.0);
    EXPECT_DOUBLE_EQ(ten.min, 1.0);
    EXPECT_DOUBLE_EQ(ten.max, 10.0);
    EXPECT_DOUBLE_EQ(ten.mean, 5.5);
    const Statistics one = summarise({3});
    EXPECT_DOUBLE_EQ(one.median, 3.0);
    EXPECT_DOUBLE_EQ(one.p90, 3.0);
    EXPECT_DOUBLE_EQ(summarise({}).median, 0.0);
    EXPECT_DOUBLE_EQ(summarise({2, 1, 3}).median, 2.0);
}

TEST(SpeedSentence, SaysHowManyTimesAsFastOrAsLong)
{
    EXPECT_EQ(compareSteps(18.1, 68.2), "A step takes 18 ms instead of 68: 3.8 times as fast");
    EXPECT_EQ(compareSteps(0.043, 1.3), "A step takes 0.043 ms instead of 1.3: 30 times as fast");
    EXPECT_EQ(compareSteps(1234, 812), "A step takes 1234 ms instead of 812: 1.5 times as long");
    EXPECT_EQ(compareSteps(2.0, 212.0), "A step takes 2.0 ms instead of 212: 106 times as fast");
}

TEST(SpeedSentence, SaysAsLongWhenTheDifferenceIsSmall)
{
    EXPECT_EQ(compareSteps(18.11, 18.42), "A step takes 18.1 ms instead of 18.4: as long, within 5 %");
    EXPECT_EQ(compareSteps(18.42, 18.11), "A step takes 18.4 ms instead of 18.1: as long, within 5 %");
    EXPECT_EQ(compareSteps(2.0, 2.0), "A step takes 2.000 ms instead of 2.000: as long, within 5 %");
    EXPECT_EQ(compareSteps(1.0, 1.06), "A step takes 1.0 ms instead of 1.1: 1.1 times as fast");
    EXPECT_EQ(compareSteps(1.06, 1.0), "A step takes 1.1 ms instead of 1.0: 1.1 times as long");
}

TEST(SpeedSentence, IsEmptyWithoutTimes)
{
    EXPECT_EQ(compareSteps(0.0, 1.0), "");
    EXPECT_EQ(compareSteps(1.0, 0.0), "");
}

TEST(SpeedSentence, UsesSingularForOneAndPluralForMany)
{
    EXPECT_EQ(countOf(0, "body", "bodies"), "0 bodies");
    EXPECT_EQ(countOf(1, "body", "bodies"), "1 body");
    EXPECT_EQ(countOf(2, "body", "bodies"), "2 bodies");
}

std::string textOf(const std::string& path)
{
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
}

TEST(BenchCases, SaveRowsOfAllOthersWhenOneThrows)
{
    const std::string path = testing::TempDir() + "bench_cases.csv";
    ResultFile file({}, "", path);
    std::string early;
    const std::vector<BenchCase> cases = {{"first",
                                           [&] {
                                               file.addRow({{"scene", "one"}});
                                           }},
                                          {"second", [] { throw std::runtime_error("no memory"); }},
                                          {"third",
                                           [&]
                                           {
                                               early = textOf(path);
                                               file.addRow({{"scene", "three"}});
                                           }},
                                          {"fourth", [] { throw std::runtime_error("lost"); }}};
    try
    {
        measureCases(cases, file);
        FAIL();
    }
    catch (const ProgramError& error)
    {
        EXPECT_EQ(error.code(), kExitDisagreement);
        EXPECT_STREQ(error.what(), "second: no memory; fourth: lost");
    }
    EXPECT_NE(early.find("\none,"), std::string::npos) << early;
    EXPECT_EQ(early.find("three"), std::string::npos) << early;
    const std::string saved = textOf(path);
    EXPECT_NE(saved.find("\none,"), std::string::npos) << saved;
    EXPECT_NE(saved.find("\nthree,"), std::string::npos) << saved;
    EXPECT_NO_THROW(measureCases({cases[0], cases[2]}, file));
    std::remove(path.c_str());
}

TEST(HashCheck, RejectsAnswerThatDiffersFromFirstOne)
{
    HashCheck check;
    check.require("W1, 1000 bodies", "grid", 3, 7);
    check.require("W1, 1000 bodies", "rows", 3, 7);
    check.require("W1, 2000 bodies", "rows", 4, 9);
    for (const auto& [pairs, hash] : {std::pair{3, 8}, {4, 7}})
    {
        try
        {
            check.require("W1, 1000 bodies", "tiles", pairs, hash);
            FAIL() << pairs << " pairs, hash " << hash;
        }
        catch (const ProgramError& error)
        {
            EXPECT_EQ(error.code(), kExitDisagreement);
            const std::string message = error.what();
            for (const char* part : {"W1, 1000 bodies", "grid has 3 (hash 0000000000000007)", "tiles has "})
                EXPECT_NE(message.find(part), std::string::npos) << message;
            EXPECT_EQ(message.find("the pairs disagree"), 0u) << message;
        }
    }
}

TEST(HashCheck, NamesWhatItCompares)
{
    HashCheck check("the transforms");
    check.require("boxes", "stock", 3, 7);
    try
    {
        check.require("boxes", "world", 3, 8);
        FAIL() << "no exception";
    }
    catch (const ProgramError& error)
    {
        EXPECT_EQ(std::string(error.what()).find("the transforms disagree, boxes: stock has 3"), 0u)
            << error.what();
    }
}

TEST(Progress, FormatsDurationsAsMinutesAndHours)
{
    EXPECT_EQ(formatDuration(-1), "--:--");
    EXPECT_EQ(formatDuration(5), "0:05");
    EXPECT_EQ(formatDuration(65), "1:05");
    EXPECT_EQ(formatDuration(7380), "2:03:00");
}

TEST(ResultFile, QuotesCsvFieldsAndLeavesMissingOnesEmpty)
{
    const std::string path = testing::TempDir() + "cullet_result_file.csv";
    ResultFile file({}, "", path);
    file.addRow({{"benchmark", "a,\"b\""}, {"pairs", 3}});
    file.addRow({{"benchmark", "c"}, {"frames", 2}});
    file.save();
    std::ifstream stream(path);
    std::string line;
    std::getline(stream, line);
    EXPECT_EQ(line, "benchmark,pairs,frames,cpu,gpu,commit,machine");
    std::getline(stream, line);
    EXPECT_EQ(line.rfind("\"a,\"\"b\"\"\",3,,", 0), 0u) << line;
    std::getline(stream, line);
    EXPECT_EQ(line.rfind("c,,2,", 0), 0u) << line;
    std::remove(path.c_str());
}

TEST(ResultFile, RefusesAPathThatCannotBeOpened)
{
    try
    {
        ResultFile file({}, "/nowhere/x.json", "");
        FAIL() << "no exception";
    }
    catch (const ProgramError& error)
    {
        EXPECT_EQ(error.code(), kExitOutput);
    }
}
}  // namespace
}  // namespace cullet
