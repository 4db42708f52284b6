// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/narrow/epa/depth_check.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
TEST(DepthOracle, AgreesOnHundredThousandDepthsWithinTenThousandth)
{
    const DepthTally regular = checkDepths<float>(false, 0.0, 75000, 201);
    const DepthTally thin = checkDepths<float>(true, 0.0, 70000, 202);
    const DepthTally far = checkDepths<float>(false, 1e4, 16000, 203);
    expectGood(regular, 1e-4, "regular");
    expectGood(thin, 1e-4, "thin");
    expectGood(far, 1e-4, "far");
    EXPECT_GE(regular.queries + thin.queries + far.queries, 100000);
}
}  // namespace
}  // namespace cullet::test
