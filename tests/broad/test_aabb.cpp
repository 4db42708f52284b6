// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/aabb.h"
#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <random>

namespace cullet::test
{
namespace
{
constexpr float kLargest = std::numeric_limits<float>::max();
constexpr float kTiny = std::numeric_limits<float>::denorm_min();

/// Whether both roundings bracket the value, with no float in between.
bool isTightBracket(double value)
{
    const float below = roundDownToFloat(value);
    const float above = roundUpToFloat(value);
    const bool isBracket = static_cast<double>(below) <= value && static_cast<double>(above) >= value;
    const bool isTight = static_cast<double>(std::nextafter(below, kInfinity)) > value &&
                         static_cast<double>(std::nextafter(above, -kInfinity)) < value;
    const bool isFloat = static_cast<double>(static_cast<float>(value)) == value;
    return isBracket && isTight && isFloat == (below == above);
}

TEST(RoundToFloat, BracketsRandomDoublesOfAllMagnitudes)
{
    std::mt19937_64 engine(1);
    int downCount = 0;
    int denormalCount = 0;
    for (int i = 0; i < 200000; ++i)
    {
        // Random bits for sign and mantissa; exponents from below the smallest denormal to just inside the range.
        const std::uint64_t bits = engine();
        const int exponent = static_cast<int>(bits >> 53) % (128 + 160) - 160;
        const double mantissa = 1.0 + static_cast<double>(bits & 0xfffffffffffffull) * 0x1p-52;
        const double value = std::ldexp((bits >> 52 & 1) != 0 ? -mantissa : mantissa, exponent);
        if (std::fabs(value) > kLargest)
            continue;
        ASSERT_TRUE(isTightBracket(value)) << value;
        downCount += static_cast<double>(static_cast<float>(value)) > value ? 1 : 0;
        denormalCount += std::fabs(value) < std::numeric_limits<float>::min() ? 1 : 0;
    }
    EXPECT_GT(downCount, 50000) << "half of the nearest floats are on the wrong side";
    EXPECT_GT(denormalCount, 10000);
}

TEST(RoundToFloat, KeepsFloats)
{
    Random random(2);
    for (int i = 0; i < 100000; ++i)
    {
        const std::uint32_t bits = random.bits();
        float value = 0;
        std::memcpy(&value, &bits, sizeof value);
        if (std::isnan(value))
            continue;
        ASSERT_EQ(roundDownToFloat(value), value);
        ASSERT_EQ(roundUpToFloat(value), value);
    }
}

TEST(RoundToFloat, GoesToInfinityOrTheLargestFloatBeyondTheRange)
{
    for (const double huge : {3.5e38, 1e39, 1e300, std::numeric_limits<double>::max()})
    {
        EXPECT_EQ(roundDownToFloat(huge), kLargest);
        EXPECT_EQ(roundUpToFloat(huge), kInfinity);
        EXPECT_EQ(roundDownToFloat(-huge), -kInfinity);
        EXPECT_EQ(roundUpToFloat(-huge), -kLargest);
    }
    EXPECT_EQ(roundDownToFloat(HUGE_VAL), kInfinity);
    EXPECT_EQ(roundUpToFloat(-HUGE_VAL), -kInfinity);
}

/// Numbers of every kind that a rounding may meet.
double oddNumber(std::mt19937_64& engine)
{
    const double kOdd[] = {0.0,     1e-300, 1e-46,       3e-45,
                           1.2e-38, 1.0,    1.0 + 1e-12, 3.4028234e38,
                           3.5e38,  1e300,  HUGE_VAL,    std::numeric_limits<double>::quiet_NaN()};
    const std::uint64_t bits = engine();
    double value = kOdd[bits % std::size(kOdd)];
    if ((bits >> 32) % 3 == 0)
        value = std::ldexp(static_cast<double>(bits >> 11), static_cast<int>(bits % 290) - 205);
    return (bits >> 40 & 1) != 0 ? -value : value;
}

TEST(RoundToFloat, RoundsThreeNumbersAsEachOne)
{
    const auto bitsOf = [](float value)
    {
        std::uint32_t bits;
        std::memcpy(&bits, &value, sizeof bits);
        return bits;
    };
    std::mt19937_64 engine(3);
    int steps = 0;
    for (int i = 0; i < 300000; ++i)
    {
        const double values[3] = {oddNumber(engine), oddNumber(engine), oddNumber(engine)};
        float below[3], above[3];
        roundThreeToFloat<false>(values[0], values[1], values[2], below);
        roundThreeToFloat<true>(values[0], values[1], values[2], above);
        for (int k = 0; k < 3; ++k)
        {
            ASSERT_EQ(bitsOf(below[k]), bitsOf(roundDownToFloat(values[k]))) << values[k];
            ASSERT_EQ(bitsOf(above[k]), bitsOf(roundUpToFloat(values[k]))) << values[k];
            steps += below[k] < above[k];
        }
    }
    EXPECT_GT(steps, 300000);
    EXPECT_LT(steps, 800000);
}

TEST(RoundToFloat, DoesNotLoseDoublesBelowTheSmallestDenormal)
{
    EXPECT_EQ(roundUpToFloat(1e-300), kTiny);
    EXPECT_EQ(roundDownToFloat(1e-300), 0.0f);
    EXPECT_EQ(roundUpToFloat(-1e-300), 0.0f);
    EXPECT_EQ(roundDownToFloat(-1e-300), -kTiny);
}

TEST(Aabb, IsInvalidWhenInvertedOrNanOnAnyAxis)
{
    EXPECT_TRUE(isValid(cube(0, 0)));
    EXPECT_TRUE(isValid(cube(-kInfinity, kInfinity)));
    EXPECT_FALSE(isValid(kEmptyAabb));
    for (int axis = 0; axis < 3; ++axis)
    {
        Aabb box = cube(0, 1);
        box.min[axis] = std::nextafter(1.0f, 2.0f);
        EXPECT_FALSE(isValid(box));
        box.min[axis] = kNan;
        EXPECT_FALSE(isValid(box));
        box = cube(0, 1);
        box.max[axis] = kNan;
        EXPECT_FALSE(isValid(box));
    }
}

TEST(Aabb, OverlapsWhenFacesTouchButNotAcrossGapOnAnyAxis)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        for (const float side : {-1.0f, 1.0f})
        {
            Aabb other = cube(0, 1);
            other.min[axis] += side;
            other.max[axis] += side;
            EXPECT_TRUE(overlaps(cube(0, 1), other));
            EXPECT_TRUE(overlaps(other, cube(0, 1)));
            (side > 0 ? other.min[axis] : other.max[axis]) += side * 1e-6f;
            EXPECT_FALSE(overlaps(cube(0, 1), other));
            EXPECT_FALSE(overlaps(other, cube(0, 1)));
        }
    }
}

TEST(Aabb, DoesNotOverlapWhenCoordinateIsNan)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        Aabb box = cube(0, 1);
        box.min[axis] = kNan;
        EXPECT_FALSE(overlaps(box, cube(0, 1)));
        EXPECT_FALSE(overlaps(cube(0, 1), box));
    }
}

TEST(Aabb, OverlapsAlikeWithZeroMarginAndInBranchlessForms)
{
    Random random(3);
    const float values[] = {-kInfinity, -kLargest, -1,       -kTiny, -0.0f,
                            0,          kTiny,     1e-30f,   1,      std::nextafter(1.0f, 2.0f),
                            2,          kLargest,  kInfinity};
    int overlapCount = 0;
    for (int i = 0; i < 200000; ++i)
    {
        Aabb boxes[2];
        for (Aabb& box : boxes)
        {
            for (int axis = 0; axis < 3; ++axis)
            {
                const float a = values[random.below(13)];
                const float b = values[random.below(13)];
                box.min[axis] = std::min(a, b);
                box.max[axis] = std::max(a, b);
            }
        }
        ASSERT_EQ(overlaps(boxes[0], boxes[1]), overlapsWithMargin(boxes[0], boxes[1], 0));
        ASSERT_EQ(overlaps(boxes[0], boxes[1]), overlapsBranchless(boxes[0], boxes[1]));
        for (const float margin : {0.0f, 0.5f, kLargest})
            ASSERT_EQ(overlapsWithMargin(boxes[0], boxes[1], margin),
                      overlapsWithMarginBranchless(boxes[0], boxes[1], margin));
        overlapCount += overlaps(boxes[0], boxes[1]) ? 1 : 0;
    }
    EXPECT_GT(overlapCount, 20000);
    EXPECT_LT(overlapCount, 180000);
}

TEST(Aabb, OverlapsAcrossGapOfTwiceTheMarginOnAnyAxisAndSide)
{
    const Aabb box = cube(0, 1);
    for (int axis = 0; axis < 3; ++axis)
    {
        for (const float side : {-1.0f, 1.0f})
        {
            Aabb other = cube(0, 1);
            other.min[axis] += side * 1.5f;
            other.max[axis] += side * 1.5f;
            EXPECT_TRUE(overlapsWithMargin(box, other, 0.25f));
            EXPECT_TRUE(overlapsWithMargin(other, box, 0.25f));
            EXPECT_FALSE(overlapsWithMargin(box, other, std::nextafter(0.25f, 0.0f)));
            EXPECT_FALSE(overlapsWithMargin(other, box, std::nextafter(0.25f, 0.0f)));
        }
    }
}

TEST(Aabb, OverlapsWhenBothBoxesReachTheSameInfinity)
{
    const Aabb everything = cube(-kInfinity, kInfinity);
    const Aabb corner = cube(kInfinity, kInfinity);
    EXPECT_TRUE(overlaps(everything, corner));
    EXPECT_TRUE(overlapsWithMargin(everything, corner, 0));
    EXPECT_TRUE(overlapsWithMargin(corner, corner, 0));
    EXPECT_FALSE(overlapsWithMargin(corner, cube(0, 1), 1));
    EXPECT_FALSE(overlapsWithMargin(corner, cube(-kInfinity, -kInfinity), 1));
}
}  // namespace
}  // namespace cullet::test
