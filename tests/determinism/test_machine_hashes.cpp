// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/shapes/shape_boxes.h"
#include "cullet/tests/determinism/machine_hashes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

namespace cullet::test
{
namespace
{
/// Where Bullet's library has fused multiply-adds, as Debian's for ARM, numbers of contacts and bodies have other last bits:
/// pairs and queries remain.
std::vector<std::string> comparable(std::vector<std::string> lines)
{
    if (!hasBulletsBoxes())
    {
        for (std::string& line : lines)
            line.erase(std::min(line.size(), line.find(" contacts")));
    }
    return lines;
}

TEST(MachineHashes, AreThoseOfEveryMachine)
{
    const std::vector<std::string> hashes = machineHashes();
    for (const std::string& line : hashes)
        std::printf("%s\n", line.c_str());
    if (!hasBulletsBoxes())
        std::printf("contacts and bodies not compared: Bullet's library has fused multiply-adds\n");
    EXPECT_EQ(comparable(hashes), comparable(recordedHashes()));
}
}  // namespace
}  // namespace cullet::test
