// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// After fork() parent and child go on with the worlds that there were, bit for bit, and make others.
#include "cullet/tests/determinism/forked.h"
#include "cullet/tests/determinism/hash_ledger.h"
#include "cullet/tests/support/threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>

namespace cullet::test
{
namespace
{
constexpr const char* kWhat = "fork";

HistoryOptions optionsOf(HistoryScene scene, int threads = 3)
{
    HistoryOptions options;
    options.scene = scene;
    options.threads = threads;
    options.isParallelWorld = true;
    return options;
}

History after(const History& history, int steps)
{
    return History(history.begin() + steps, history.end());
}

TEST(Fork, LetsChildAndParentGoOnBitForBitAfterAnyNumberOfSteps)
{
    for (const HistoryScene scene : {HistoryScene::Pour, HistoryScene::Drift})
    {
        const int steps = stepsOf(scene);
        const History expected = historyOf(optionsOf(scene, 1));
        for (const int threads : {1, 3})
        {
            for (int before = 0; before < steps; before += steps / 6)
            {
                HistoryWorld world(optionsOf(scene, threads));
                world.run(before);
                const auto goOn = [&] { return world.run(steps - before); };
                ForkedHistory child(goOn);
                const std::string how =
                    std::to_string(threads) + " threads, after step " + std::to_string(before);
                HashLedger::instance().expectSame(kWhat, after(expected, before), goOn(), "parent, " + how);
                HashLedger::instance().expectSame(kWhat, after(expected, before), child.wait(),
                                                  "child, " + how);
                ASSERT_FALSE(HasFailure());
            }
        }
    }
}

TEST(Fork, LetsChildMakeWorldsBesideInheritedOneAndAfterIt)
{
    const History expected = historyOf(optionsOf(HistoryScene::Drift));
    auto inherited = std::make_unique<HistoryWorld>(optionsOf(HistoryScene::Drift));
    inherited->run(3);
    ForkedHistory beside([] { return historyOf(optionsOf(HistoryScene::Drift)); });
    ForkedHistory behind(
        [&]
        {
            inherited.reset();
            return historyOf(optionsOf(HistoryScene::Drift));
        });
    ForkedHistory grandchild(
        [&]
        {
            inherited->run(1);
            ForkedHistory inner([] { return historyOf(optionsOf(HistoryScene::Drift)); });
            return inner.wait();
        });
    HashLedger& ledger = HashLedger::instance();
    ledger.expectSame(kWhat, expected, beside.wait(), "a world beside the inherited one");
    ledger.expectSame(kWhat, expected, behind.wait(), "a world after the inherited one");
    ledger.expectSame(kWhat, expected, grandchild.wait(), "a world in a child's child");
    ledger.expectSame(kWhat, after(expected, 3), inherited->run(stepsOf(HistoryScene::Drift) - 3), "parent");
}

/// Worlds of hulls that a thread makes, steps and drops until the end.
class BusyThread
{
public:
    BusyThread()
        : m_thread(
              [this]
              {
                  while (!m_isOver)
                      HistoryWorld(optionsOf(HistoryScene::Drift)).run(2);
              })
    {
    }
    ~BusyThread()
    {
        m_isOver = true;
        m_thread.join();
    }
    BusyThread(const BusyThread&) = delete;
    BusyThread& operator=(const BusyThread&) = delete;

private:
    std::atomic<bool> m_isOver{false};
    std::thread m_thread;
};

// What another thread does at that moment is lost in the child; what the library locks for it must not stay locked.
TEST(Fork, LeavesChildUsableWhileAnotherThreadUpdatesItsWorld)
{
    const int steps = stepsOf(HistoryScene::Drift);
    const History expected = historyOf(optionsOf(HistoryScene::Drift));
    const BusyThread other;
    for (int round = 0; round < 40 && !HasFailure(); ++round)
    {
        HistoryWorld world(optionsOf(HistoryScene::Drift));
        world.run(2);
        std::this_thread::sleep_for(std::chrono::microseconds(700 * (round % 10)));
        ForkedHistory child(
            [&]
            {
                History history = world.run(3);
                HistoryWorld another(optionsOf(HistoryScene::Drift));
                for (const Fingerprint& step : another.run(2))
                    history.push_back(step);
                return history;
            });
        History wanted(expected.begin() + 2, expected.begin() + 5);
        wanted.insert(wanted.end(), expected.begin(), expected.begin() + 2);
        HashLedger::instance().expectSame(kWhat, wanted, child.wait(), "round " + std::to_string(round));
        HashLedger::instance().expectSame(kWhat, after(expected, 2), world.run(steps - 2), "parent");
    }
}
}  // namespace
}  // namespace cullet::test
