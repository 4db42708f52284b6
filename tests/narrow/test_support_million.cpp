// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "tests/narrow/support_check.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
TEST(SupportMillion, AllMethodsFindTheScansVertexInTenMillionDirections)
{
    compareOnAllShapes<float>(600000, 10000, 10000000);
}
}  // namespace
}  // namespace cullet::test
