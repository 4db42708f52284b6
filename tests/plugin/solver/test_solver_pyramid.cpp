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

TEST(SolverPyramid, KeepsItsRowsNoWorseThanStock)
{
    expectAsStock(largePyramid);
}
}  // namespace
}  // namespace cullet::test
