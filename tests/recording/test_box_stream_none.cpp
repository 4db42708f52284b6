// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Always linked with what a build without zlib has.
#include "cullet/recording/box_stream.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace cullet
{
namespace
{
TEST(BoxStreamWithoutZlib, WriterSaysThatZlibIsMissingAndLeavesNoFile)
{
    const std::string path = testing::TempDir() + "cullet_box_stream_none.cbx";
    BoxStreamWriter writer(path, StreamPrecision::Float);
    writer.create(0, {}, 1, 1);
    writer.frame();
    EXPECT_FALSE(writer.finish());
    EXPECT_NE(writer.error().find("zlib"), std::string::npos) << writer.error();
    EXPECT_NE(writer.error().find(path), std::string::npos) << writer.error();
    EXPECT_EQ(writer.info().events, 0u);
    EXPECT_FALSE(std::ifstream(path));
}

TEST(BoxStreamWithoutZlib, ReaderSaysThatZlibIsMissing)
{
    std::string why;
    EXPECT_EQ(BoxStreamReader::open("a.cbx", why), nullptr);
    EXPECT_NE(why.find("zlib"), std::string::npos) << why;
    EXPECT_EQ(BoxStreamReader::open(std::make_unique<std::istringstream>(""), "b.cbx", why), nullptr);
    EXPECT_NE(why.find("'b.cbx'"), std::string::npos) << why;
}
}  // namespace
}  // namespace cullet
