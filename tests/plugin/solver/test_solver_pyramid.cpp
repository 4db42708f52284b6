// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/solver/pyramid.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
Measures largePyramid(SolverScene& scene)
{
    return pyramid(scene, 44, 300);
}

TEST(SolverPyramid, KeepsItsRowsNoWorseThanStockWithModelBullet)
{
    expectAsStock(largePyramid, 1, {Contender::Bullet});
}

TEST(SolverPyramid, StandsWithModelSoft)
{
    SolverScene scene(Contender::Soft);
    for (const Measure& measure : largePyramid(scene))
        EXPECT_LT(measure.value, 0.25) << measure.name;
}
}  // namespace
}  // namespace cullet::test
