// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/narrow/gjk/boolean_check.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace cullet::test
{
namespace
{
/// A million queries of five classes, none of them wrong.
///
/// @param limits gaps that are asked for
/// @param expect expect(tally, name) of each
template <class Expect>
void checkAMillion(unsigned seed, const std::vector<double>& limits, const Expect& expect)
{
    const Tally regular = checkAll<float>(false, 0.0, 4500, 0, seed, limits);
    const Tally thin = checkAll<float>(true, 0.0, 5500, 0, seed + 1, limits);
    const Tally far = checkAll<float>(false, 1e4, 1500, 0, seed + 2, limits);
    const Tally warm = checkAll<float>(false, 0.0, 80, 40, seed + 3, limits);
    const Tally warmThin = checkAll<float>(true, 0.0, 80, 40, seed + 4, limits);
    expect(regular, "regular");
    expect(thin, "thin");
    expect(far, "far");
    expect(warm, "warm");
    expect(warmThin, "warm thin");
    // Undecided: the gap or depth is too small to be told from rounding.
    std::int64_t decided = 0;
    for (const Tally& tally : {regular, thin, far, warm, warmThin})
        decided += tally.queries - tally.undecided;
    EXPECT_GE(decided, 1000000);
}

TEST(IsaGjkMillion, NoBooleanOfAMillionIsWrong)
{
    checkAMillion(101, {0.0}, [](const Tally& tally, const char* name) { expectGood(tally, name); });
}

/// As the plug-in asks: margins and breaking threshold are a gap.
TEST(IsaGjkMillion, NoGapOfAMillionIsWrong)
{
    checkAMillion(111, askedGaps(),
                  [](const Tally& tally, const char* name) { expectGoodGaps(tally, name); });
}
}  // namespace
}  // namespace cullet::test
