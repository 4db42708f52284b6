// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A world that is saved and restored after any of its steps goes on bit for bit, where it does with Bullet's narrow phase.
#include "cullet/tests/determinism/hash_ledger.h"
#include "cullet/tests/plugin/world/saved_world.h"
#include "cullet/tests/support/number_hash.h"
#if defined(CULLET_TESTS_IMPORTER)
#include "cullet/tests/plugin/world/saved_file.h"
#endif

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr int kSteps = 60, kStepsAfter = 6;

std::uint64_t hashOf(const Moment& moment)
{
    NumberHash hash;
    for (const auto& numbers : moment)
        for (const btScalar number : numbers)
            hash.add(number);
    return hash.value();
}

void expectSameFuture(const std::string& what, const Future& expected, const Future& actual, int step)
{
    ASSERT_EQ(firstDifference(expected, actual), "") << what << ", saved after step " << step;
    for (std::size_t i = 0; i < expected.size(); ++i)
        HashLedger::instance().expectSame(what, hashOf(expected[i]), hashOf(actual[i]),
                                          "saved after step " + std::to_string(step));
}

class SaveAtEveryStep : public testing::TestWithParam<Narrow>
{
protected:
    /// A heap that falls, touches and rolls.
    void build(SavedWorld& saved, bool sleeps = true)
    {
        std::mt19937 engine(4);
        saved.add(m_ground, 0, vec(0, -1, 0));
        btConvexHullShape* const kinds[] = {m_brick.get(), m_ball.get(), m_cube.get()};
        for (int i = 0; i < 24; ++i)
        {
            const btTransform at(randomRotation(engine),
                                 vec(0.75 * (i % 3), 0.5 + 0.8 * (i / 9), 0.75 * (i / 3 % 3)));
            btRigidBody& body = saved.add(*kinds[i % 3], 1, at);
            // Bullet's files do not have the time since a body has come to rest.
            body.setActivationState(sleeps ? ACTIVE_TAG : DISABLE_DEACTIVATION);
        }
    }

    btBoxShape m_ground{vec(20, 1, 20)};
    const std::unique_ptr<btConvexHullShape> m_brick = makeHullShape(boxPoints(0.4, 0.3, 0.3)),
                                             m_ball = makeHullShape(ballPoints(20, 0.4, 5)),
                                             m_cube = makeHullShape(boxPoints(0.35, 0.35, 0.35));
};

TEST_P(SaveAtEveryStep, RepeatsFutureFromTransformsAndVelocities)
{
    SavedWorld saved(GetParam());
    build(saved);
    int withContacts = 0;
    for (int step = 0; step < kSteps; ++step)
    {
        const Moment moment = saved.now();
        saved.forgetContacts();
        const Future first = saved.run(kStepsAfter);
        withContacts += saved.contacts() > 0;
        saved.restore(moment);
        saved.forgetContacts();
        expectSameFuture("restored from transforms and velocities", first, saved.run(kStepsAfter), step);
        ASSERT_FALSE(HasFailure());
        saved.restore(moment);
        saved.forgetContacts();
        saved.step();
    }
    EXPECT_GT(withContacts, kSteps / 2);
}

#if defined(CULLET_TESTS_IMPORTER)
TEST_P(SaveAtEveryStep, RepeatsFutureFromBulletFile)
{
    SavedWorld saved(GetParam());
    build(saved, false);
    int withContacts = 0;
    for (int step = 0; step < kSteps; ++step)
    {
        const std::vector<char> file = saveFile(saved);
        const Future first = saved.run(kStepsAfter);
        withContacts += saved.contacts() > 0;
        SavedWorld fresh(GetParam());
        build(fresh, false);
        restoreFile(fresh, file);
        expectSameFuture("restored from .bullet, another world", first, fresh.run(kStepsAfter), step);
        // The importer leaves the contacts of pairs that had none.
        saved.forgetContacts();
        restoreFile(saved, file);
        expectSameFuture("restored from .bullet, same world", first, saved.run(kStepsAfter), step);
        ASSERT_FALSE(HasFailure());
        saved.forgetContacts();
        restoreFile(saved, file);
        saved.step();
    }
    EXPECT_GT(withContacts, kSteps / 2);
}
#endif

INSTANTIATE_TEST_SUITE_P(NarrowPhases, SaveAtEveryStep,
                         testing::Values(Narrow::Stock, Narrow::IsaGjk, Narrow::Dispatcher),
                         testing::PrintToStringParamName());
}  // namespace
}  // namespace cullet::test
