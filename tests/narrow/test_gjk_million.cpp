// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "tests/narrow/boolean_check.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
TEST(IsaGjkMillion, RegularPairs)
{
    expectGood(checkAll<float>(false, 0.0, 4500, 0, 101), "regular");
}

TEST(IsaGjkMillion, ThinPairs)
{
    expectGood(checkAll<float>(true, 0.0, 5500, 0, 102), "thin");
}

TEST(IsaGjkMillion, PairsFarFromTheOrigin)
{
    expectGood(checkAll<float>(false, 1e4, 1500, 0, 103), "far");
}

TEST(IsaGjkMillion, Trajectories)
{
    expectGood(checkAll<float>(false, 0.0, 80, 40, 104), "warm");
    expectGood(checkAll<float>(true, 0.0, 80, 40, 105), "warm thin");
}
}  // namespace
}  // namespace cullet::test
