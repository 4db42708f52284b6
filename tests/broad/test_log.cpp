// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/log.h"

#include <gtest/gtest.h>

#include <string>

namespace cullet
{
namespace
{
std::string printed(LogLevel level, const char* message)
{
    testing::internal::CaptureStderr();
    log(level, message);
    return testing::internal::GetCapturedStderr();
}

TEST(Log, PrintsWarningsAndErrorsAloneUnlessApplicationTakesThem)
{
    EXPECT_EQ(printed(LogLevel::Error, "a 100 %s loss"), "cullet: error: a 100 %s loss\n");
    EXPECT_EQ(printed(LogLevel::Warning, "a doubt"), "cullet: warning: a doubt\n");
    EXPECT_EQ(printed(LogLevel::Info, "a fact"), "");
    static std::string received;
    setLogFunction([](LogLevel level, const char* message)
                   { received += std::to_string(static_cast<int>(level)) + message; });
    EXPECT_EQ(printed(LogLevel::Error, "taken"), "");
    EXPECT_EQ(received, std::to_string(static_cast<int>(LogLevel::Error)) + "taken");
    setLogFunction(nullptr);
    EXPECT_EQ(printed(LogLevel::Error, "back"), "cullet: error: back\n");
}

TEST(Log, NamesPlaceAndHintOfBrokenPromise)
{
    testing::internal::CaptureStderr();
    const bool mustStop = reportAssertion("a < b", "sort first", "here.cpp", 12);
    EXPECT_EQ(testing::internal::GetCapturedStderr(),
              "cullet: error: here.cpp:12: 'a < b' does not hold; sort first\n");
    EXPECT_TRUE(mustStop);
    static int calls = 0;
    setAssertHandler(
        [](const char*, const char*, const char*, int line)
        {
            calls += line;
            return false;
        });
    EXPECT_FALSE(reportAssertion("a", "b", "c", 3));
    EXPECT_EQ(calls, 3);
    setAssertHandler(nullptr);
}
}  // namespace
}  // namespace cullet
