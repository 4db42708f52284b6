// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Fingerprints of the answers about fixed pairs of hulls, the same for every compiler, instruction set and machine.
//
// A red test with one compiler or flag: something depends on the order of evaluation, on contraction, or on vectors whose
// lanes are added in another order. If it is red everywhere, the answers changed: put the new value in only if that was the
// purpose, and say in the commit why.
#include "cullet/tests/support/hull_answers.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
template <class S>
void expectAnswers(std::uint64_t hash)
{
    const HullAnswers answers = hullAnswers<S>();
    EXPECT_GT(answers.separated, 60);
    EXPECT_GT(answers.near, 200);
    EXPECT_GT(answers.overlapping, 100);
    EXPECT_EQ(answers.hash.value(), hash) << std::hex << "0x" << answers.hash.value() << "u";
}

TEST(NarrowGolden, ReproducesRecordedAnswersOfFloatHulls)
{
    expectAnswers<float>(0x4a558fa593ed0f06u);
}

TEST(NarrowGolden, ReproducesRecordedAnswersOfDoubleHulls)
{
    expectAnswers<double>(0x124a1c21f685169du);
}
}  // namespace
}  // namespace cullet::test
