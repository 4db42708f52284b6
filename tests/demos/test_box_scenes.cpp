// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/box_scene.h"
#include "cullet/demos/scenes/exact_pairs.h"
#include "cullet/demos/scenes/extreme_scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ostream>

namespace cullet
{
namespace
{
constexpr std::uint32_t kBodies = 16384;
/// Number of bodies for scenes in which nearly all bodies overlap each other.
constexpr std::uint32_t kDenseBodies = 600;

Pairs pairsOf(const BoxScene& scene)
{
    std::vector<ExactBox> boxes;
    for (const Aabb& box : scene.boxes())
        boxes.push_back(toExactBox(box));
    return findExactPairs(boxes);
}

std::uint64_t hashOf(const std::vector<Aabb>& boxes)
{
    std::uint64_t hash = 0;
    for (const Aabb& box : boxes)
    {
        std::uint32_t words[6];
        std::memcpy(words, &box, sizeof(words));
        for (const std::uint32_t word : words)
            hash = splitMix(hash ^ word);
    }
    return hash;
}

/// Documented properties of a scene.
struct Promise
{
    const char* scene;
    double fewestPairs;  ///< per body
    double mostPairs;
    std::size_t moved;   ///< per frame
    std::uint64_t hash;  ///< of the boxes after three frames
    std::uint32_t bodies = kBodies;
};

std::ostream& operator<<(std::ostream& out, const Promise& promise)
{
    return out << promise.scene;
}

class EveryBoxScene : public testing::TestWithParam<Promise>
{
protected:
    std::unique_ptr<BoxScene> make(bool sortedIds = false) const
    {
        const BoxSceneInfo* info = findBoxScene(GetParam().scene);
        return info == nullptr ? nullptr : info->make({GetParam().bodies, sortedIds, 12345});
    }
};

TEST_P(EveryBoxScene, HasThePromisedPairsPerBodyInEveryFrame)
{
    const auto scene = make();
    ASSERT_NE(scene, nullptr);
    for (int frame = 0; frame < 3; ++frame)
    {
        const double perBody = static_cast<double>(pairsOf(*scene).size()) / GetParam().bodies;
        EXPECT_GE(perBody, GetParam().fewestPairs) << "frame " << frame;
        EXPECT_LE(perBody, GetParam().mostPairs) << "frame " << frame;
        scene->step();
    }
}

TEST_P(EveryBoxScene, MovesExactlyTheRowsThatItNames)
{
    const auto scene = make();
    ASSERT_NE(scene, nullptr);
    EXPECT_TRUE(scene->moved().empty());
    scene->step();
    const std::vector<Aabb> before = scene->boxes();
    scene->step();
    EXPECT_EQ(scene->moved().size(), GetParam().moved);
    std::vector<std::uint32_t> changed;
    for (std::uint32_t row = 0; row < before.size(); ++row)
    {
        if (before[row] != scene->boxes()[row])
            changed.push_back(row);
    }
    EXPECT_EQ(scene->moved(), changed);
}

TEST_P(EveryBoxScene, MatchesStoredHashOnEveryMachine)
{
    const auto scene = make();
    ASSERT_NE(scene, nullptr);
    for (int frame = 0; frame < 3; ++frame)
        scene->step();
    EXPECT_EQ(hashOf(scene->boxes()), GetParam().hash) << std::hex << "0x" << hashOf(scene->boxes());
}

TEST_P(EveryBoxScene, HasAsManyPairsAndNearerNeighboursWithSortedIds)
{
    const auto random = make(false);
    const auto sorted = make(true);
    ASSERT_NE(random, nullptr);
    EXPECT_EQ(pairsOf(*random).size(), pairsOf(*sorted).size());
    if (std::string(GetParam().scene) == "point")
        return;  // equal boxes
    EXPECT_NE(hashOf(random->boxes()), hashOf(sorted->boxes()));
    // Neighbours on the curve are near each other: the mean step from row to row shrinks several times.
    const auto meanStep = [](const std::vector<Aabb>& boxes)
    {
        double sum = 0.0;
        for (std::size_t row = 1; row < boxes.size(); ++row)
        {
            for (int axis = 0; axis < 3; ++axis)
                sum += std::abs(boxes[row].min[axis] - boxes[row - 1].min[axis]);
        }
        return sum / static_cast<double>(boxes.size());
    };
    EXPECT_LT(meanStep(sorted->boxes()) * 3.0, meanStep(random->boxes()));
}

INSTANTIATE_TEST_SUITE_P(AllScenes, EveryBoxScene,
                         testing::Values(Promise{"W1", 0.9, 1.05, kBodies, 0x26c7f3192ca62f02ull},
                                         Promise{"W2", 3.2, 4.0, kBodies, 0xf67b5f39577b74a5ull},
                                         Promise{"W3", 0.9, 1.05, kBodies / 20, 0x3a9a24ffa3c6fe09ull},
                                         Promise{"W3b", 0.9, 1.05, kBodies / 20, 0x60345383cb3117efull},
                                         Promise{"W3fresh", 0.9, 1.05, kBodies / 10, 0xd9903ae22d374ebaull},
                                         Promise{"W4", 2.7, 3.4, kBodies, 0x2046dd33c58a7f03ull},
                                         Promise{"settle", 0.55, 0.65, kBodies, 0x115961652e02ee6eull},
                                         Promise{"W5", 0.9, 1.05, kBodies, 0x36306b54bd75fbf7ull},
                                         Promise{"pile", 6.5, 8.5, kBodies, 0xac6dc12b76058055ull},
                                         Promise{"static", 0.9, 1.05, 100, 0x5fe11d8980377734ull},
                                         Promise{"cell", 0.64 * kDenseBodies / 2, 0.74 * kDenseBodies / 2,
                                                 kDenseBodies, 0xa1d029b5133c7c1aull, kDenseBodies},
                                         Promise{"line", 3.9, 4.1, kBodies, 0x20c8260f200d7e9dull},
                                         Promise{"diagonal", 3.9, 4.1, kBodies, 0x541915ce9ecc1c9dull},
                                         Promise{"point", (kDenseBodies - 1) / 2.0, (kDenseBodies - 1) / 2.0,
                                                 kDenseBodies, 0x4fb8f79e5e0192d6ull, kDenseBodies},
                                         Promise{"cover", 1.9, 2.05, kBodies, 0xb301abb236f38a9aull},
                                         Promise{"decades", 3.0, 5.0, kBodies, 0x114a3d75dfebe53dull}),
                         [](const auto& test) { return std::string(test.param.scene); });

TEST(BoxScenes, AreAllUnderTest)
{
    EXPECT_EQ(boxScenes().size(), 16u) << "add the new scene to the list of promises";
}

TEST(BoxScenes, GiveAboutRequestedPairCountWhenBalanced)
{
    for (const double perBody : {0.5, 1.0, 4.0, 32.0})
    {
        SCOPED_TRACE(perBody);
        const auto scene = makeBalancedScene({kBodies, false, 1}, perBody * kBodies);
        EXPECT_NEAR(static_cast<double>(pairsOf(*scene).size()) / (perBody * kBodies), 1.0, 0.05);
    }
    EXPECT_EQ(pairsOf(*makeBalancedScene({50, false, 1}, 1e9)).size(), 50u * 49 / 2);
    EXPECT_EQ(makeBalancedScene({1, false, 1}, 0)->boxes().size(), 1u);
}

TEST(BoxScenes, SpanSixDecadesOfSizesInSceneDecades)
{
    const auto scene = findBoxScene("decades")->make({kBodies, false, 12345});
    float smallest = 1e9f;
    float largest = 0;
    for (const Aabb& box : scene->boxes())
    {
        smallest = std::min(smallest, box.max[0] - box.min[0]);
        largest = std::max(largest, box.max[0] - box.min[0]);
    }
    EXPECT_GT(largest, 0.99e6f * 1e-3f);
    EXPECT_LT(smallest, 1.5e-3f);
}

TEST(BoxScenes, GiveNullForUnknownNames)
{
    EXPECT_EQ(findBoxScene("W6"), nullptr);
    EXPECT_EQ(findBoxScene("w1"), nullptr);
}

TEST(BoxScenes, TakeSmallNumbersOfBodies)
{
    for (const BoxSceneInfo& info : boxScenes())
    {
        for (const std::uint32_t bodies : {1u, 2u, 10u, 100u})
        {
            SCOPED_TRACE(std::string(info.name) + " with " + std::to_string(bodies));
            const auto scene = info.make({bodies, false, 1});
            scene->step();
            EXPECT_EQ(scene->boxes().size(), bodies);
        }
    }
}
}  // namespace
}  // namespace cullet
