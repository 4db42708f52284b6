// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Many boxes that no partition divides, or that no plan covers: the pairs of the grid, in bounded memory.

#include "cullet/demos/scenes/extreme_scenes.h"
#include "cullet/demos/scenes/fresh_boxes.h"
#include "cullet/tests/cuda/support/box_frames.h"
#include "cullet/tests/cuda/support/named_options.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr std::uint32_t kMany = 120000;
constexpr int kFrames = 3;

BoxFrames framesOfScene(std::unique_ptr<cullet::BoxScene> (*make)(const BoxSceneOptions&),
                        std::uint32_t bodies)
{
    BoxSceneOptions options;
    options.bodies = bodies;
    const auto scene = make(options);
    BoxFrames frames = {scene->boxes()};
    for (int frame = 1; frame < kFrames; ++frame)
    {
        scene->step();
        frames.push_back(scene->boxes());
    }
    return frames;
}

/// Boxes of one size, with a few unbounded, some huge and many invalid ones, different in each frame.
BoxFrames unboundedHugeAndInvalid()
{
    BoxFrames frames;
    for (std::uint32_t frame = 0; frame < kFrames; ++frame)
    {
        std::vector<Aabb> boxes = uniformBoxes(kMany, 1);
        for (std::uint32_t k = 0; k < 4; ++k)
        {
            const std::uint32_t row = 1000 * frame + 17 * k;
            boxes[row] = cube(-kInfinity, kInfinity);
            boxes[row + 1] = cube(-1e30f, 1e30f);
            boxes[row + 2] = {{-kInfinity, 5, 5}, {kInfinity, 6, 6}};
            boxes[row + 3] = {{20, -kInfinity, 3}, {21, 1e18f, kInfinity}};
            boxes[row + 4] = cube(3e38f, kInfinity);
            boxes[row + 5] = boxAt(-1e12f, 1e20f, 7, 1e3f);
        }
        for (std::uint32_t row = 50000 + frame; row < kMany; row += 10)
            boxes[row] = row % 20 < 10 ? cube(kNan, 1) : cube(2, 1);
        frames.push_back(boxes);
    }
    return frames;
}

struct Extreme
{
    std::string name;
    std::function<BoxFrames()> frames;
};

void PrintTo(const Extreme& extreme, std::ostream* out)
{
    *out << extreme.name;
}

/// Bound of a search's memory: per box and pair, with growth, and a constant.
std::uint64_t mostBytes(std::uint64_t boxes, std::uint64_t pairs)
{
    return 2048 * boxes + 128 * pairs + (64u << 20);
}

class CudaExtremes : public testing::TestWithParam<Extreme>
{
};

TEST_P(CudaExtremes, GiveSamePairsAsGridInBoundedMemory)
{
    const BoxFrames frames = GetParam().frames();
    const PairStream expected = follow(*makeGridBackend(), frames);
    EXPECT_GT(expected.added, frames[0].size());
    for (const NamedOptions& variant : allOrders())
    {
        SCOPED_TRACE(variant.name);
        const auto backend = makeCudaBackend(variant.options);
        EXPECT_EQ(follow(*backend, frames), expected);
        EXPECT_LT(backend->stats().bytes, mostBytes(frames[0].size(), expected.added));
    }
}

const Extreme kExtremes[] = {
    {"OnePoint", [] { return framesOfScene(makeOnePointScene, 3000); }},
    {"OneCell", [] { return framesOfScene(makeOneCellScene, 3000); }},
    {"Line", [] { return framesOfScene(makeLineScene, kMany); }},
    {"Diagonal", [] { return framesOfScene(makeDiagonalScene, kMany); }},
    {"OneBoxOverAll", [] { return framesOfScene(makeCoverScene, kMany); }},
    {"SixDecades", [] { return framesOfScene(makeSixDecadesScene, kMany); }},
    {"UnboundedHugeAndInvalid", unboundedHugeAndInvalid},
};

std::string nameOfExtreme(const testing::TestParamInfo<Extreme>& info)
{
    return info.param.name;
}
INSTANTIATE_TEST_SUITE_P(Cuda, CudaExtremes, testing::ValuesIn(kExtremes), nameOfExtreme);
}  // namespace
}  // namespace cullet::test
