// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// World<btDiscreteDynamicsWorld> takes the same steps as btDiscreteDynamicsWorld, bit for bit: each test steps a scene in
// both and compares a hash of all state after each step.
#include "cullet/base/sanitizer.h"
#include "cullet/tests/plugin/world/step_stage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>
#include <string>

namespace cullet::test
{
void PrintTo(const NamedScene& scene, std::ostream* stream)
{
    *stream << scene.name;
}

namespace
{
#if defined(CULLET_IS_SANITIZED)
constexpr int kSteps = 180;
#else
constexpr int kSteps = 600;
#endif

/// Expects equal hashes, and says from which step on they differ.
void expectSame(const History& own, const History& expected, const std::string& what)
{
    ASSERT_EQ(own.hashes.size(), expected.hashes.size());
    const auto difference = std::mismatch(own.hashes.begin(), own.hashes.end(), expected.hashes.begin());
    EXPECT_EQ(difference.first - own.hashes.begin(), std::ptrdiff_t(own.hashes.size())) << what;
    EXPECT_EQ(own.events, expected.events) << what;
}

class WorldSteps : public testing::TestWithParam<NamedScene>
{
};

INSTANTIATE_TEST_SUITE_P(Scenes, WorldSteps, testing::ValuesIn(allScenes()),
                         [](const auto& test) { return std::string(test.param.name); });

using Parallel = World<btDiscreteDynamicsWorld>;

TEST_P(WorldSteps, EqualThoseOfBulletOnAnyNumberOfThreads)
{
    const NamedScene& scene = GetParam();
    const bool isLarge = std::string(scene.name) == "ManyRagdolls";
    const int steps = isLarge ? kSteps / 6 : kSteps;
    const History expected = run<btDiscreteDynamicsWorld>(scene, steps, 0);
    EXPECT_GT(expected.events, 0) << "the scene tests nothing";
    EXPECT_NE(expected.hashes.front(), expected.hashes.back());
    for (const int threads : {1, 2, 3, 8, 16})
    {
        const History own = run<Parallel>(scene, steps, threads);
        expectSame(own, expected, std::to_string(threads) + " threads");
        const bool isParallel = threads > 1 && scene.hasManyIslands;
        EXPECT_GE(own.mostTasks, isParallel ? 2u : 0u)
            << "no islands in parallel on " << threads << " threads";
    }
}
}  // namespace
}  // namespace cullet::test
