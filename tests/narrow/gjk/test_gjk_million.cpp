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
/// Runs a million queries of five classes, none of which may be wrong.
///
/// @param limits required gaps
/// @param expect expect(tally, name) is called for each class
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
    // Undecided queries have gaps or depths within rounding.
    std::int64_t decided = 0;
    for (const Tally& tally : {regular, thin, far, warm, warmThin})
        decided += tally.queries - tally.undecided;
    EXPECT_GE(decided, 1000000);
}

TEST(IsaGjkMillion, AnswersMillionBooleanQueriesWithoutError)
{
    checkAMillion(101, {0.0}, [](const Tally& tally, const char* name) { expectGood(tally, name); });
}

/// Queries as by the plug-in: the limit is margins and breaking threshold.
TEST(IsaGjkMillion, AnswersMillionGapQueriesWithoutError)
{
    checkAMillion(111, askedGaps(),
                  [](const Tally& tally, const char* name) { expectGoodGaps(tally, name); });
}
}  // namespace
}  // namespace cullet::test
