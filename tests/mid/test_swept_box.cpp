// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/mid/swept_box.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace cullet
{
namespace
{
TEST(SweptBox, IsRefusedWhenNumberIsNotFiniteOrTooLarge)
{
    const double infinity = std::numeric_limits<double>::infinity();
    for (const double bad : {std::nan(""), infinity, -infinity, 1e19})
    {
        for (int place = 0; place < 12; ++place)
        {
            SweptBox box = {{0, 0, 0}, {1, 0, 0}, {0, 0, 0}, {0, 0, 0}};
            SweptQuery query;
            ASSERT_TRUE(box.prepare(query));
            double* const parts[4] = {box.origin, box.motion, box.min, box.max};
            parts[place / 3][place % 3] = bad;
            EXPECT_FALSE(box.prepare(query)) << bad << " at " << place;
        }
    }
}

TEST(SweptBox, HasFiniteInversesWhenItRests)
{
    const SweptBox box = {{1, 2, 3}, {0, -0.0, 1e-300}, {0, 0, 0}, {0, 0, 0}};
    SweptQuery query;
    ASSERT_TRUE(box.prepare(query));
    for (const float inverse : query.inverse)
    {
        EXPECT_TRUE(std::isfinite(inverse));
        EXPECT_NE(inverse, 0.0f);
    }
}

TEST(SweptBox, HasLimitAboveShare)
{
    for (const double share : {0.0, 1e-9, 0.3, 1.0})
    {
        EXPECT_GE(sweptLimit(share), share);
        EXPECT_LE(sweptLimit(share), share * 1.000001);
    }
}
}  // namespace
}  // namespace cullet
