// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A world that is saved and restored after any of its steps goes on bit for bit, where it does with Bullet's narrow phase.
#include "cullet/tests/determinism/hash_ledger.h"
#include "cullet/tests/determinism/saved_scenes.h"
#include "cullet/tests/support/number_hash.h"
#if defined(CULLET_TESTS_IMPORTER)
#include "cullet/tests/plugin/world/saved_file.h"
#endif

#include <gtest/gtest.h>

#include <string>
#include <tuple>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr int kSteps = 40, kStepsAfter = 6;

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

using Parameter = std::tuple<Narrow, SavedScene>;

class SaveAtEveryStep : public testing::TestWithParam<Parameter>
{
protected:
    Narrow narrow() const { return std::get<Narrow>(GetParam()); }
    SavedScene scene() const { return std::get<SavedScene>(GetParam()); }
    void build(SavedWorld& saved, bool sleeps) const { m_scenes.build(saved, scene(), sleeps); }

    /// @param withContacts steps in which bodies touched
    void expectTouching(const SavedWorld& saved, int withContacts) const
    {
        EXPECT_GT(withContacts, kSteps / 2);
        if (narrow() != Narrow::Stock)
        {
            EXPECT_GT(saved.touchingTotal(), 200u) << "others made the contacts";
        }
    }

private:
    SavedScenes m_scenes;
};

TEST_P(SaveAtEveryStep, RepeatsFutureFromTransformsAndVelocities)
{
    SavedWorld saved(narrow());
    build(saved, true);
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
    expectTouching(saved, withContacts);
}

#if defined(CULLET_TESTS_IMPORTER)
/// Bullet's importer restores the first manifold of a pair only.
bool bulletRestores(SavedScene scene)
{
    return scene != SavedScene::Compounds;
}

TEST_P(SaveAtEveryStep, RepeatsFutureFromBulletFile)
{
    SavedWorld saved(narrow());
    build(saved, false);
    int withContacts = 0, different = 0;
    const auto compare = [&](const char* what, const Future& first, const Future& again, int step)
    {
        if (bulletRestores(scene()))
            expectSameFuture(what, first, again, step);
        different += !firstDifference(first, again).empty();
    };
    for (int step = 0; step < kSteps; ++step)
    {
        const std::vector<char> file = saveFile(saved);
        const Future first = saved.run(kStepsAfter);
        withContacts += saved.contacts() > 0;
        SavedWorld fresh(narrow());
        build(fresh, false);
        restoreFile(fresh, file);
        compare("restored from .bullet, another world", first, fresh.run(kStepsAfter), step);
        // The importer leaves the contacts of pairs that had none.
        saved.forgetContacts();
        restoreFile(saved, file);
        compare("restored from .bullet, same world", first, saved.run(kStepsAfter), step);
        ASSERT_FALSE(HasFailure());
        saved.forgetContacts();
        restoreFile(saved, file);
        saved.step();
    }
    expectTouching(saved, withContacts);
    EXPECT_EQ(different == 0, bulletRestores(scene())) << different << " of " << 2 * kSteps << " differ";
}
#endif

std::string nameOf(const testing::TestParamInfo<Parameter>& info)
{
    return testing::PrintToString(std::get<Narrow>(info.param)) + "_" +
           testing::PrintToString(std::get<SavedScene>(info.param));
}

INSTANTIATE_TEST_SUITE_P(NarrowPhases, SaveAtEveryStep,
                         testing::Combine(testing::Values(Narrow::Stock, Narrow::IsaGjk, Narrow::Dispatcher),
                                          testing::Values(SavedScene::Hulls, SavedScene::Boxes,
                                                          SavedScene::Compounds, SavedScene::SparseCompounds,
                                                          SavedScene::Mesh, SavedScene::Ragdolls,
                                                          SavedScene::Multibodies)),
                         nameOf);
}  // namespace
}  // namespace cullet::test
