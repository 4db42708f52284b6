// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "tests/narrow/boolean_check.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
TEST(IsaGjkMillion, NoBooleanOfAMillionIsWrong)
{
    const Tally regular = checkAll<float>(false, 0.0, 4500, 0, 101);
    const Tally thin = checkAll<float>(true, 0.0, 5500, 0, 102);
    const Tally far = checkAll<float>(false, 1e4, 1500, 0, 103);
    const Tally warm = checkAll<float>(false, 0.0, 80, 40, 104);
    const Tally warmThin = checkAll<float>(true, 0.0, 80, 40, 105);
    expectGood(regular, "regular");
    expectGood(thin, "thin");
    expectGood(far, "far");
    expectGood(warm, "warm");
    expectGood(warmThin, "warm thin");
    // None is counted whose gap or depth is too small to be told from rounding.
    std::int64_t decided = 0;
    for (const Tally& tally : {regular, thin, far, warm, warmThin})
        decided += tally.queries - tally.undecided;
    EXPECT_GE(decided, 1000000);
}

/// As the plug-in asks: margins and breaking threshold are a gap.
TEST(IsaGjkMillion, NoGapOfAMillionIsWrong)
{
    const Tally regular = checkAll<float>(false, 0.0, 4500, 0, 111, askedGaps());
    const Tally thin = checkAll<float>(true, 0.0, 5500, 0, 112, askedGaps());
    const Tally far = checkAll<float>(false, 1e4, 1500, 0, 113, askedGaps());
    const Tally warm = checkAll<float>(false, 0.0, 80, 40, 114, askedGaps());
    const Tally warmThin = checkAll<float>(true, 0.0, 80, 40, 115, askedGaps());
    expectGoodGaps(regular, "regular");
    expectGoodGaps(thin, "thin");
    expectGoodGaps(far, "far");
    expectGoodGaps(warm, "warm");
    expectGoodGaps(warmThin, "warm thin");
    std::int64_t decided = 0;
    for (const Tally& tally : {regular, thin, far, warm, warmThin})
        decided += tally.queries - tally.undecided;
    EXPECT_GE(decided, 1000000);
}
}  // namespace
}  // namespace cullet::test
