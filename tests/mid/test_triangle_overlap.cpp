// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/mid/triangle_overlap.h"
#include "cullet/tests/mid/test_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace cullet::test
{
namespace
{
using FloatTriangle = float[3][3];

struct EightAndOne
{
    TriangleBlock block;
    FloatTriangle eight[8];
    FloatTriangle one;
};

void setRandom(FloatTriangle& triangle, Random& random, float extent, float size)
{
    const Triangle drawn = randomTriangle(random, extent, size);
    for (std::size_t corner = 0; corner < 3; ++corner)
    {
        for (std::size_t axis = 0; axis < 3; ++axis)
            triangle[corner][axis] = static_cast<float>(drawn[corner][axis]);
    }
}

EightAndOne randomCase(Random& random)
{
    EightAndOne drawn;
    setRandom(drawn.one, random, 1.0f, 1.0f);
    for (FloatTriangle& triangle : drawn.eight)
    {
        setRandom(triangle, random, 1.5f, 1.0f);
        if (random.chance(0.1f))
        {
            // In the plane of the other one.
            for (float(&corner)[3] : triangle)
            {
                const float s = random.between(-2.0f, 2.0f), t = random.between(-2.0f, 2.0f);
                for (int axis = 0; axis < 3; ++axis)
                    corner[axis] = drawn.one[0][axis] + s * (drawn.one[1][axis] - drawn.one[0][axis]) +
                                   t * (drawn.one[2][axis] - drawn.one[0][axis]);
            }
        }
        else if (random.chance(0.1f))
        {
            std::copy(triangle[1], triangle[1] + 3, triangle[2]);
        }
    }
    for (int lane = 0; lane < 8; ++lane)
    {
        for (int corner = 0; corner < 3; ++corner)
        {
            for (int axis = 0; axis < 3; ++axis)
                drawn.block.corners[corner][axis][lane] = drawn.eight[lane][corner][axis];
        }
    }
    return drawn;
}

Triangle toDouble(const FloatTriangle& triangle)
{
    Triangle result;
    for (std::size_t corner = 0; corner < 3; ++corner)
    {
        for (std::size_t axis = 0; axis < 3; ++axis)
            result[corner][axis] = triangle[corner][axis];
    }
    return result;
}

/// The largest gap along the axes of a separating axis test, in double, by the length of the axis; negative: none.
double largestGap(const Triangle& a, const Triangle& b)
{
    std::vector<Point> axes;
    const Point normalA = cross(a[1] - a[0], a[2] - a[0]), normalB = cross(b[1] - b[0], b[2] - b[0]);
    axes.push_back(normalA);
    axes.push_back(normalB);
    for (std::size_t i = 0; i < 3; ++i)
    {
        const Point edgeA = a[(i + 1) % 3] - a[i], edgeB = b[(i + 1) % 3] - b[i];
        axes.push_back(cross(normalA, edgeA));
        axes.push_back(cross(normalB, edgeB));
        for (std::size_t k = 0; k < 3; ++k)
            axes.push_back(cross(edgeA, b[(k + 1) % 3] - b[k]));
    }
    double largest = -std::numeric_limits<double>::infinity();
    for (const Point& axis : axes)
    {
        const double length = std::sqrt(dot(axis, axis));
        if (!(length > 1e-12))
            continue;
        const auto heights = [&](const Triangle& t) {
            return std::minmax({dot(axis, t[0]), dot(axis, t[1]), dot(axis, t[2])});
        };
        const auto [lowA, highA] = heights(a);
        const auto [lowB, highB] = heights(b);
        largest = std::max(largest, std::max(lowA - highB, lowB - highA) / length);
    }
    return largest;
}

/// Whether an edge of one crosses the other.
bool cross(const Triangle& a, const Triangle& b)
{
    for (std::size_t i = 0; i < 3; ++i)
    {
        if (crossing(b, a[i], a[(i + 1) % 3] - a[i]) || crossing(a, b[i], b[(i + 1) % 3] - b[i]))
            return true;
    }
    return false;
}

TEST(TriangleOverlap, SeparatesTrianglesThatAreApartAndNoOthers)
{
    constexpr unsigned kSeed = 31;
    Random random(kSeed);
    int crossingCount = 0, apartCount = 0, proved = 0;
    for (int i = 0; i < 20000; ++i)
    {
        const EightAndOne drawn = randomCase(random);
        const std::uint32_t apart = trianglesApart(drawn.block, drawn.one);
        for (int lane = 0; lane < 8; ++lane)
        {
            const Triangle a = toDouble(drawn.eight[lane]), b = toDouble(drawn.one);
            const bool isProved = (apart >> lane & 1u) != 0;
            const double gap = largestGap(a, b);
            proved += isProved ? 1 : 0;
            if (isProved)
            {
                ASSERT_GT(gap, 0.0) << "seed " << kSeed << ", case " << i << ", lane " << lane;
                ASSERT_FALSE(cross(a, b)) << "seed " << kSeed << ", case " << i << ", lane " << lane;
            }
            else
            {
                ASSERT_LT(gap, 1e-3) << "seed " << kSeed << ", case " << i << ", lane " << lane;
            }
            crossingCount += cross(a, b) ? 1 : 0;
            apartCount += gap > 1e-3 ? 1 : 0;
        }
    }
    EXPECT_GT(crossingCount, 5000);
    EXPECT_GT(apartCount, 50000);
    EXPECT_GE(proved, apartCount);
}

TEST(TriangleOverlap, GivesSameBitsWithEachInstructionSet)
{
    Random random(32);
    for (int i = 0; i < 2000; ++i)
    {
        EightAndOne drawn = randomCase(random);
        if (i % 10 == 0)
            drawn.block.corners[i % 3][1][i % 8] = std::numeric_limits<float>::quiet_NaN();
        ASSERT_EQ(trianglesApart(drawn.block, drawn.one, kMeshKernelsBaseline),
                  trianglesApart(drawn.block, drawn.one))
            << i;
    }
}

TEST(TriangleOverlap, ProvesNothingOfTrianglesThatAreNotFinite)
{
    Random random(33);
    EightAndOne drawn = randomCase(random);
    for (float& coordinate : drawn.block.corners[1][2])
        coordinate = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(trianglesApart(drawn.block, drawn.one), 0u);
}
}  // namespace
}  // namespace cullet::test
