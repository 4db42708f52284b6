// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A world saved by Bullet's serialiser and restored by Bullet's importer, as by saveState and restoreState of Bullet's
// Python binding, repeats its evolution bit by bit, as with Bullet's narrow phase.

#include "cullet/tests/plugin/world/saved_file.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr int kSaves = 5, kStepsPerSave = 8, kStepsSaved = 20;
constexpr unsigned kHeapSeed = 36;

using Build = std::function<void(SavedWorld&)>;

void expectTheSameAfterLoading(Narrow narrow, int fallSteps, const Build& build)
{
    SavedWorld saved(narrow);
    build(saved);
    saved.run(fallSteps);
    for (int save = 0; save < kSaves && !testing::Test::HasFailure(); ++save)
    {
        SCOPED_TRACE("save " + std::to_string(save));
        saved.run(kStepsPerSave);
        const std::vector<char> file = saveFile(saved);
        const Future first = saved.run(kStepsSaved);
        ASSERT_GT(saved.contacts(), 0) << "nothing to remember";
        restoreFile(saved, file);
        EXPECT_EQ(firstDifference(first, saved.run(kStepsSaved)), "") << "the same world";

        SavedWorld fresh(narrow);
        build(fresh);
        restoreFile(fresh, file);
        EXPECT_EQ(firstDifference(first, fresh.run(kStepsSaved)), "") << "a world that was just made";
    }
    if (narrow != Narrow::Stock)
    {
        EXPECT_GT(saved.touchingTotal(), 200u) << "others made the contacts";
    }
}

class SaveRestoreImporter : public testing::TestWithParam<Narrow>
{
protected:
    btBoxShape m_ground{vec(20, 1, 20)};
    const std::unique_ptr<btConvexHullShape> m_brick = makeHullShape(boxPoints(0.4, 0.3, 0.3)),
                                             m_ball = makeHullShape(ballPoints(20, 0.4, 5));
};
}  // namespace

TEST_P(SaveRestoreImporter, RepeatsHeapOfHullsBitForBit)
{
    expectTheSameAfterLoading(
        GetParam(), 40,
        [&](SavedWorld& saved)
        {
            std::mt19937 engine(kHeapSeed);
            saved.add(m_ground, 0, vec(0, -1, 0));
            for (int i = 0; i < 18; ++i)
            {
                const btTransform at(randomRotation(engine),
                                     vec(0.8 * (i % 3), 0.8 + 1.0 * (i / 6), 0.8 * (i / 3 % 2)));
                saved.add(i % 2 == 0 ? *m_brick : *m_ball, 1, at).setActivationState(DISABLE_DEACTIVATION);
            }
        });
}

TEST_P(SaveRestoreImporter, RepeatsMultibodiesBitForBit)
{
    expectTheSameAfterLoading(GetParam(), 40,
                              [&](SavedWorld& saved)
                              {
                                  saved.add(m_ground, 0, vec(0, -1, 0));
                                  for (int i = 0; i < 5; ++i)
                                      saved.addChain(
                                          {m_brick.get(), m_ball.get(), m_brick.get(), m_brick.get()},
                                          btTransform(btQuaternion(vec(1, 0, 0), btScalar(0.3 + i)),
                                                      vec(0.2 * i, 0.8 + 0.9 * i, 0.2 * i)));
                              });
}

INSTANTIATE_TEST_SUITE_P(NarrowPhases, SaveRestoreImporter,
                         testing::Values(Narrow::Stock, Narrow::IsaGjk, Narrow::Dispatcher),
                         testing::PrintToStringParamName());
}  // namespace cullet::test
