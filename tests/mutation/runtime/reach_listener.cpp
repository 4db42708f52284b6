// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Part of each test program: records by test what is reached.
#include "cullet/tests/mutation/runtime/reach.h"

#include <gtest/gtest.h>

#include <string>

namespace
{
class ReachListener final : public testing::EmptyTestEventListener
{
    // What has been reached before the first test and between two is reached by what runs for all of them.
    void OnTestStart(const testing::TestInfo&) override
    {
        cullet_mutants::writeReached("*", 0);
        cullet_mutants::forgetReached();
    }

    void OnTestEnd(const testing::TestInfo& test) override
    {
        const std::string name = std::string(test.test_suite_name()) + "." + test.name();
        const std::string outcome = test.result()->Failed() ? "!" + name : name;
        cullet_mutants::writeReached(outcome.c_str(), static_cast<long>(test.result()->elapsed_time()));
        cullet_mutants::forgetReached();
    }
};

struct Registration
{
    Registration() { testing::UnitTest::GetInstance()->listeners().Append(new ReachListener); }
};
const Registration registration;
}  // namespace
