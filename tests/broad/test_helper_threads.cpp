// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/helper_threads.h"
#include "broad/worker_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <optional>
#include <thread>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr std::chrono::seconds kLongEnough{60};

/// Whether `count` threads take part in one loop: each task waits for all others.
bool meet(WorkerPool& workers, unsigned count)
{
    const auto end = std::chrono::steady_clock::now() + kLongEnough;
    std::atomic<unsigned> here{0};
    workers.runPromptly(count,
                        [&](unsigned)
                        {
                            ++here;
                            while (here.load() < count && std::chrono::steady_clock::now() < end)
                                std::this_thread::yield();
                        });
    return std::chrono::steady_clock::now() < end;
}

TEST(HelperThreads, AsManyComeAsAreCalled)
{
    WorkerPool two(2);
    WorkerPool five(5);
    for (int loop = 0; loop < 200; ++loop)
    {
        ASSERT_TRUE(meet(two, 2));
        ASSERT_TRUE(meet(five, 5));
    }
}

TEST(HelperThreads, ComeAgainAfterTheyHaveSlept)
{
    WorkerPool workers(3);
    for (int loop = 0; loop < 20; ++loop)
    {
        ASSERT_TRUE(meet(workers, 3));
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
}

TEST(HelperThreads, EndWithTheLastPool)
{
    std::weak_ptr<HelperThreads> threads;
    {
        WorkerPool first(2);
        auto second = std::make_unique<WorkerPool>(3);
        ASSERT_TRUE(meet(first, 2));
        ASSERT_TRUE(meet(*second, 3));
        threads = HelperThreads::shared();
        second.reset();
        EXPECT_FALSE(threads.expired());
    }
    EXPECT_TRUE(threads.expired());
    WorkerPool later(2);
    EXPECT_TRUE(meet(later, 2));
}

TEST(HelperThreads, AreSharedByWorldsOnSeveralThreads)
{
    constexpr unsigned kWorlds = 4, kLoops = 300, kTasks = 40;
    std::vector<std::thread> worlds;
    std::vector<std::uint64_t> sums(kWorlds);
    for (unsigned world = 0; world < kWorlds; ++world)
        worlds.emplace_back(
            [&sums, world]
            {
                // Some that come and go, too.
                std::optional<WorkerPool> workers;
                for (unsigned loop = 0; loop < kLoops; ++loop)
                {
                    if (loop % 50 == 0)
                        workers.emplace(2 + static_cast<int>(world));
                    std::vector<unsigned> done(kTasks);
                    workers->runPromptly(kTasks, [&](unsigned task) { done[task] += task; });
                    for (const unsigned task : done)
                        sums[world] += task;
                }
            });
    for (std::thread& world : worlds)
        world.join();
    for (const std::uint64_t sum : sums)
        EXPECT_EQ(sum, std::uint64_t{kLoops} * kTasks * (kTasks - 1) / 2);
}

TEST(HelperThreads, NobodyComesWhereTooManyCall)
{
    const auto threads = HelperThreads::shared();
    std::vector<std::unique_ptr<TaskCrew>> crews;
    std::vector<std::unique_ptr<HelperThreads::Call>> calls;
    for (int crew = 0; crew < 64; ++crew)
    {
        crews.push_back(std::make_unique<TaskCrew>(2));
        crews.back()->open();
        calls.push_back(std::make_unique<HelperThreads::Call>(*threads, *crews.back()));
    }
    WorkerPool workers(2);
    unsigned owners = 0;
    const auto note = [&](unsigned, unsigned thread) { owners |= 1u << thread; };
    workers.runPromptly(100, note);
    EXPECT_EQ(owners, 1u);
    for (const auto& crew : crews)
        crew->close();
    calls.clear();
    EXPECT_TRUE(meet(workers, 2));
}

TEST(HelperThreads, NobodyComesLaterThanTheCallThatAskedForIt)
{
    HelperThreads threads;
    TaskCrew closed(2);
    for (int loop = 0; loop < 300; ++loop)
    {
        {
            HelperThreads::Call call(threads, closed);
            call.ask(1);
        }
        TaskCrew crew(2);
        crew.open();
        unsigned owners = 0;
        {
            HelperThreads::Call call(threads, crew);
            const auto end = std::chrono::steady_clock::now() + std::chrono::microseconds(50);
            const auto dawdle = [&](unsigned, unsigned thread)
            {
                owners |= 1u << thread;
                while (std::chrono::steady_clock::now() < end)
                    std::this_thread::yield();
            };
            crew.run(2, dawdle);
            crew.close();
        }
        ASSERT_EQ(owners, 1u);
    }
}

TEST(HelperThreads, FailuresReachTheCaller)
{
    WorkerPool workers(3);
    const auto fail = [](unsigned task)
    {
        if (task == 5)
            throw std::bad_alloc();
    };
    for (int loop = 0; loop < 50; ++loop)
    {
        EXPECT_THROW(workers.runPromptly(10, fail), std::bad_alloc);
        ASSERT_TRUE(meet(workers, 3));
    }
}

#if defined(__unix__) && !defined(__SANITIZE_THREAD__)
// A forked process has none of the threads. Its loops are done by the one that it has, and nothing waits for the others.
TEST(HelperThreadsDeathTest, AForkedProcessGoesOnAlone)
{
    auto workers = std::make_unique<WorkerPool>(3);
    ASSERT_TRUE(meet(*workers, 3));
    EXPECT_EXIT(
        {
            unsigned sum = 0;
            workers->runPromptly(10, [&](unsigned task) { sum += task; });
            workers.reset();
            WorkerPool another(3);
            another.runPromptly(10, [&](unsigned task) { sum += task; });
            std::_Exit(sum == 90 ? 0 : 1);
        },
        testing::ExitedWithCode(0), "");
    EXPECT_TRUE(meet(*workers, 3));
}
#endif
}  // namespace
}  // namespace cullet::test
