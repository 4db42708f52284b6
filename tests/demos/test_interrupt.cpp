// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/interrupt.h"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

namespace cullet
{
namespace
{
/// Runs in a separate process, since signal handlers are global to a process.
[[noreturn]] void runSignalled(int first, std::chrono::milliseconds pause, int second)
{
    catchInterrupts();
    std::raise(first);
    std::this_thread::sleep_for(pause);
    std::raise(second);
    std::_Exit(isInterrupted() ? 0 : 1);
}

class Interrupt : public testing::Test
{
protected:
    Interrupt() { testing::GTEST_FLAG(death_test_style) = "threadsafe"; }
};

TEST_F(Interrupt, TakesSignalsThatComeTogetherAsOneRequest)
{
    // Like `timeout`: a signal to the process, then to its group.
    EXPECT_EXIT(runSignalled(SIGINT, std::chrono::milliseconds(0), SIGINT), testing::ExitedWithCode(0), "");
    EXPECT_EXIT(runSignalled(SIGTERM, std::chrono::milliseconds(1), SIGINT), testing::ExitedWithCode(0), "");
}

TEST_F(Interrupt, EndsTheProgramAtALaterSignal)
{
    EXPECT_EXIT(runSignalled(SIGINT, std::chrono::milliseconds(300), SIGINT), testing::KilledBySignal(SIGINT),
                "");
    EXPECT_EXIT(runSignalled(SIGINT, std::chrono::milliseconds(300), SIGTERM),
                testing::KilledBySignal(SIGTERM), "");
}
}  // namespace
}  // namespace cullet
