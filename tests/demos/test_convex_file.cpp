// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/convex_file.h"
#include "cullet/demos/bench/narrow/convex_on_cpu.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using namespace cullet;

/// Reads values one after another.
class Bytes
{
public:
    explicit Bytes(const std::string& path)
    {
        std::ifstream file(path, std::ios::binary);
        m_bytes.assign(std::istreambuf_iterator<char>(file), {});
    }

    template <class T>
    std::vector<T> take(std::size_t count)
    {
        std::vector<T> values(count);
        if (m_at + count * sizeof(T) > m_bytes.size())
            throw std::runtime_error("the file is too short");
        std::memcpy(values.data(), m_bytes.data() + m_at, count * sizeof(T));
        m_at += count * sizeof(T);
        return values;
    }
    std::size_t left() const { return m_bytes.size() - m_at; }

private:
    std::vector<char> m_bytes;
    std::size_t m_at = 0;
};

TEST(ConvexFile, HasHullsPosesAndPlantedDepths)
{
    ConvexMotionOptions options;
    options.pairs = 300;
    options.vertices = 20;
    options.frames = 1;
    const ConvexMotion motion(options);
    const std::string path = testing::TempDir() + "convex_file.cxpr";
    const ConvexFileSums sums = writeConvexFile(motion, 0, path);
    EXPECT_EQ(sums.overlapping, 15u);
    EXPECT_GE(sums.pointsPerContact, 1.0);
    EXPECT_LE(sums.pointsPerContact, 4.0);

    Bytes bytes(path);
    const ConvexFileHead head = bytes.take<ConvexFileHead>(1).front();
    EXPECT_EQ(std::string(head.mark, 4), "CXPR");
    EXPECT_EQ(head.version, 1u);
    ASSERT_EQ(head.hulls, motion.exactHulls().size());
    ASSERT_EQ(head.pairs, options.pairs);
    const std::vector<std::uint32_t> starts = bytes.take<std::uint32_t>(head.hulls + 1);
    ASSERT_EQ(head.points, starts.back());
    const std::vector<float> points = bytes.take<float>(std::size_t{3} * head.points);
    for (std::uint32_t hull = 0; hull < head.hulls; ++hull)
    {
        ASSERT_EQ(starts[hull + 1] - starts[hull], 20u);
        for (int i = 0; i < 20; ++i)
            for (int axis = 0; axis < 3; ++axis)
                EXPECT_EQ(points[3 * (starts[hull] + static_cast<std::uint32_t>(i)) + axis],
                          motion.exactHulls()[hull].vertex(i)[axis]);
    }
    const std::vector<BodyPose> poses = bytes.take<BodyPose>(std::size_t{2} * head.pairs);
    EXPECT_EQ(std::memcmp(poses.data(), motion.frame(0).data(), poses.size() * sizeof(BodyPose)), 0);
    const std::vector<float> depths = bytes.take<float>(head.pairs);
    EXPECT_EQ(bytes.left(), 0u);
    for (std::uint32_t pair = 0; pair < head.pairs; ++pair)
    {
        // Planted is the depth along one axis, which is never less than the true one.
        EXPECT_EQ(depths[pair] > 0.0f, pair % 100 >= 95) << pair;
        EXPECT_LE(depths[pair], 0.0501f) << pair;
    }
    std::remove(path.c_str());
}

TEST(ConvexFile, ThrowsWhereFileCannotBeWritten)
{
    ConvexMotionOptions options;
    options.pairs = 20;
    options.frames = 1;
    const ConvexMotion motion(options);
    EXPECT_THROW(writeConvexFile(motion, 0, testing::TempDir() + "no such folder/file"), std::runtime_error);
}

TEST(ConvexMotion, GoesToLastFrameAndBack)
{
    ConvexMotionOptions options;
    options.pairs = 1;
    options.frames = 3;
    const ConvexMotion three(options);
    std::vector<int> frames;
    for (int step = 0; step < 6; ++step)
        frames.push_back(three.frameAt(step));
    EXPECT_EQ(frames, (std::vector<int>{0, 1, 2, 1, 0, 1}));
    options.frames = 1;
    EXPECT_EQ(ConvexMotion(options).frameAt(5), 0);
}

TEST(ConvexMotion, MovesLastRowsOnlyWhenFirstBodiesRest)
{
    ConvexMotionOptions options;
    options.pairs = 200;
    options.frames = 3;
    options.isFirstAtRest = true;
    const ConvexMotion motion(options);
    ASSERT_EQ(motion.firstMoving(), 200u);
    const auto isSame = [](const BodyPose& a, const BodyPose& b)
    { return std::memcmp(&a, &b, sizeof(a)) == 0; };
    for (const int frame : {1, 2})
    {
        const std::vector<BodyPose>&before = motion.frame(frame - 1), &now = motion.frame(frame);
        for (std::size_t row = 0; row < now.size(); ++row)
            EXPECT_EQ(isSame(before[row], now[row]), row < motion.firstMoving()) << row;
    }
    for (std::uint32_t k = 0; k < options.pairs; ++k)
        EXPECT_TRUE(motion.pairs()[k].a == k && motion.pairs()[k].b == options.pairs + k) << k;
}

TEST(ConvexMotion, HasPlantedOverlapsForOneThread)
{
    for (const bool isFirstAtRest : {false, true})
    {
        ConvexMotionOptions options;
        options.pairs = 300;
        options.frames = 4;
        options.isFirstAtRest = isFirstAtRest;
        const ConvexMotion motion(options);
        EXPECT_EQ(motion.overlapping(), 15u);
        EXPECT_NO_THROW(timeOnOneThread(motion, 6));
        EXPECT_THROW(motion.requireOverlapping(14), std::runtime_error);
    }
}
}  // namespace
