// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/mid/mesh_box.h"
#include "cullet/tests/mid/test_meshes.h"

#include <gtest/gtest.h>

#include <cfloat>
#include <limits>

namespace cullet::test
{
namespace
{
TEST(MeshBox, ContainsCornersThatNoFloatHas)
{
    Random random(41);
    int inexact = 0;
    for (int i = 0; i < 1000; ++i)
    {
        Triangle triangle = randomTriangle(random, 10.0f, 1.0f);
        for (Point& corner : triangle)
        {
            for (double& coordinate : corner)
                coordinate += 1e-9 * random.unit();
        }
        const MeshBox box = boxOfTriangle(triangle.data(), 0.0);
        for (const Point& corner : triangle)
        {
            for (std::size_t axis = 0; axis < 3; ++axis)
            {
                ASSERT_LE(box.min[axis], corner[axis]);
                ASSERT_GE(box.max[axis], corner[axis]);
                inexact += static_cast<float>(corner[axis]) != corner[axis] ? 1 : 0;
            }
        }
    }
    EXPECT_GT(inexact, 8000);
}

TEST(MeshBox, GrowsByShareOfSize)
{
    const Triangle triangle = {Point{0, 0, 5}, Point{4, 0, 5}, Point{0, 8, 5}};
    const MeshBox box = boxOfTriangle(triangle.data(), 0.25);
    EXPECT_EQ(box.min[0], -1.0f);
    EXPECT_EQ(box.max[0], 5.0f);
    EXPECT_EQ(box.min[1], -2.0f);
    EXPECT_EQ(box.max[1], 10.0f);
    EXPECT_EQ(box.min[2], 5.0f);
    EXPECT_EQ(box.max[2], 5.0f);
}

TEST(MeshBox, IsEmptyWhenCoordinateIsNotFinite)
{
    const double infinity = std::numeric_limits<double>::infinity();
    for (const double bad : {std::nan(""), infinity, -infinity, 2.0 * FLT_MAX, -2.0 * FLT_MAX})
    {
        for (std::size_t place = 0; place < 9; ++place)
        {
            Triangle triangle = {Point{0, 0, 0}, Point{1, 0, 0}, Point{0, 1, 0}};
            triangle[place / 3][place % 3] = bad;
            EXPECT_FALSE(isValid(boxOfTriangle(triangle.data(), 0.0))) << bad << " at " << place;
        }
    }
}

TEST(MeshBox, IsInvalidWhenEmptyOrNan)
{
    EXPECT_FALSE(isValid(kEmptyMeshBox));
    for (int axis = 0; axis < 3; ++axis)
    {
        MeshBox box = {{0, 0, 0}, {1, 1, 1}};
        EXPECT_TRUE(isValid(box));
        box.max[axis] = std::numeric_limits<float>::quiet_NaN();
        EXPECT_FALSE(isValid(box));
    }
}
}  // namespace
}  // namespace cullet::test
