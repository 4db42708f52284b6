// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/base/threads/parallel_loops.h"
#include "cullet/base/threads/thread_pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <pthread.h>
#include <set>
#include <thread>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr std::chrono::seconds kLongEnough{60};

/// A region with any number of the pool's threads: a ParallelLoops uses no more threads than there are cores.
class SharedCrew
{
public:
    explicit SharedCrew(unsigned threads)
        : m_count(threads),
          m_threadPool(ThreadPool::shared()),
          m_forkJoin(threads),
          m_registration(*m_threadPool, m_forkJoin)
    {
    }

    /// Whether all threads take part in one loop, in which each task waits for all others.
    bool meet()
    {
        const auto end = std::chrono::steady_clock::now() + kLongEnough;
        std::atomic<unsigned> here{0};
        const auto waitForAll = [&](unsigned, unsigned thread)
        {
            ++here;
            while (here.load() < m_count && std::chrono::steady_clock::now() < end)
            {
                // A counted thread may just have left the previous loop.
                if (thread == 0)
                    m_registration.requestUpTo(m_count - 1);
                std::this_thread::yield();
            }
        };
        m_forkJoin.open();
        m_forkJoin.run(m_count, waitForAll, [&] { m_registration.requestUpTo(m_count - 1); });
        m_forkJoin.close();
        m_registration.end();
        return std::chrono::steady_clock::now() < end;
    }

private:
    unsigned m_count;
    std::shared_ptr<ThreadPool> m_threadPool;
    ForkJoin m_forkJoin;
    ThreadPool::Registration m_registration;
};

TEST(ThreadPool, BringsAsManyThreadsAsRequested)
{
    SharedCrew two(2);
    SharedCrew five(5);
    for (int loop = 0; loop < 200; ++loop)
    {
        ASSERT_TRUE(two.meet());
        ASSERT_TRUE(five.meet());
    }
}

TEST(ThreadPool, WakesSleepingThreadsForNextLoop)
{
    SharedCrew crew(3);
    for (int loop = 0; loop < 20; ++loop)
    {
        ASSERT_TRUE(crew.meet());
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
}

TEST(ThreadPool, EndsWithItsLastUserAndStartsAgain)
{
    std::weak_ptr<ThreadPool> threads;
    {
        auto first = std::make_unique<SharedCrew>(3);
        ASSERT_TRUE(first->meet());
        ParallelLoops second(2);
        second.run(2, [](unsigned) {});
        threads = ThreadPool::shared();
        first.reset();
        EXPECT_FALSE(threads.expired());
    }
    EXPECT_TRUE(threads.expired());
    SharedCrew later(2);
    EXPECT_TRUE(later.meet());
}

TEST(ThreadPool, RunsAllTasksWhenSeveralThreadsShareIt)
{
    constexpr unsigned kWorlds = 4, kLoops = 300, kTasks = 40;
    std::vector<std::thread> worlds;
    std::vector<std::uint64_t> sums(kWorlds);
    for (unsigned world = 0; world < kWorlds; ++world)
        worlds.emplace_back(
            [&sums, world]
            {
                // Also threads that join and leave.
                std::optional<ParallelLoops> workers;
                for (unsigned loop = 0; loop < kLoops; ++loop)
                {
                    if (loop % 50 == 0)
                        workers.emplace(2 + static_cast<int>(world));
                    std::vector<unsigned> done(kTasks);
                    workers->run(kTasks, [&](unsigned task) { done[task] += task; });
                    for (const unsigned task : done)
                        sums[world] += task;
                }
            });
    for (std::thread& world : worlds)
        world.join();
    for (const std::uint64_t sum : sums)
        EXPECT_EQ(sum, std::uint64_t{kLoops} * kTasks * (kTasks - 1) / 2);
}

TEST(ThreadPool, LeavesCallerAloneWhenAllSlotsAreTaken)
{
    const auto threads = ThreadPool::shared();
    std::vector<std::unique_ptr<ForkJoin>> crews;
    std::vector<std::unique_ptr<ThreadPool::Registration>> calls;
    for (std::size_t crew = 0; crew < ThreadPool::kMostForkJoins; ++crew)
    {
        crews.push_back(std::make_unique<ForkJoin>(2));
        crews.back()->open();
        calls.push_back(std::make_unique<ThreadPool::Registration>(*threads, *crews.back()));
    }
    ParallelLoops workers(2);
    unsigned owners = 0;
    const auto note = [&](unsigned, unsigned thread) { owners |= 1u << thread; };
    workers.run(100, note);
    EXPECT_EQ(owners, 1u);
    for (const auto& crew : crews)
        crew->close();
    calls.clear();
    SharedCrew later(2);
    EXPECT_TRUE(later.meet());
}

TEST(ThreadPool, SendsNoThreadAfterRequestingCallHasEnded)
{
    ThreadPool threads;
    ForkJoin closed(2);
    for (int loop = 0; loop < 300; ++loop)
    {
        {
            ThreadPool::Registration call(threads, closed);
            call.requestUpTo(1);
        }
        ForkJoin crew(2);
        crew.open();
        unsigned owners = 0;
        {
            ThreadPool::Registration call(threads, crew);
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

TEST(ParallelLoops, PassesTaskExceptionToCallerAndRunsNextLoop)
{
    ParallelLoops workers(3);
    const auto fail = [](unsigned task)
    {
        if (task == 5)
            throw std::bad_alloc();
    };
    for (int loop = 0; loop < 50; ++loop)
    {
        EXPECT_THROW(workers.run(10, fail), std::bad_alloc);
        std::atomic<unsigned> sum{0};
        workers.run(10, [&](unsigned task) { sum += task; });
        ASSERT_EQ(sum.load(), 45u);
    }
}

#if defined(__unix__) && !defined(__SANITIZE_THREAD__)
// A forked process has none of the pool's threads. Its single thread runs all loops, and does not wait for others.
TEST(ThreadPoolDeathTest, RunsLoopsOnOneThreadInForkedProcess)
{
    SharedCrew crew(3);
    ASSERT_TRUE(crew.meet());
    auto workers = std::make_unique<ParallelLoops>(3);
    workers->run(10, [](unsigned) {});
    EXPECT_EXIT(
        {
            unsigned sum = 0;
            workers->run(10, [&](unsigned task) { sum += task; });
            workers.reset();
            ParallelLoops another(3);
            another.run(10, [&](unsigned task) { sum += task; });
            std::_Exit(sum == 90 ? 0 : 1);
        },
        testing::ExitedWithCode(0), "");
    EXPECT_TRUE(crew.meet());
}

namespace
{
std::atomic<bool> isHeld{false}, isReleased{false};

/// Suspends the thread that receives the signal, as a busy system does.
void hold(int)
{
    isHeld = true;
    while (!isReleased)
    {
    }
}
}  // namespace

TEST(ParallelLoops, DoesNotWaitForHelperPreemptedBetweenLoops)
{
    ASSERT_NE(std::signal(SIGUSR1, hold), SIG_ERR);
    const unsigned count = std::min(2u, std::thread::hardware_concurrency());
    for (int round = 0; round < 20; ++round)
    {
        isHeld = isReleased = false;
        ParallelLoops workers(2);
        std::atomic<unsigned> here{0};
        pthread_t helper = pthread_self();
        const auto meet = [&](unsigned, unsigned thread)
        {
            if (thread != 0)
                helper = pthread_self();
            for (++here; here < count;)
                std::this_thread::yield();
        };
        const auto meetAndHold = [&]
        {
            workers.run(count, meet);
            // The thread polls for another loop, or sleeps already.
            if (count == 2)
                pthread_kill(helper, SIGUSR1);
            while (count == 2 && !isHeld)
                std::this_thread::yield();
        };
        workers.runRegion(meetAndHold);
        unsigned sum = 0;
        workers.run(10, [&](unsigned task) { sum += task; });
        EXPECT_EQ(sum, 45u);
        isReleased = true;
    }
    std::signal(SIGUSR1, SIG_DFL);
}
#endif

TEST(ParallelLoops, KeepsShortLoopsOnCallingThread)
{
    ParallelLoops workers(8);
    std::set<std::thread::id> threads;
    std::set<unsigned> numbers;
    workers.runRegion(1.9 * ParallelLoops::workPerThread,
                      [&]
                      {
                          EXPECT_EQ(workers.tasksFor(1000000, 1), 1u);
                          workers.run(100,
                                      [&](unsigned, unsigned number)
                                      {
                                          threads.insert(std::this_thread::get_id());
                                          numbers.insert(number);
                                      });
                      });
    EXPECT_EQ(threads, std::set<std::thread::id>{std::this_thread::get_id()});
    EXPECT_EQ(numbers, std::set<unsigned>{0});
}

TEST(ParallelLoops, GivesLoopsAsManyThreadsAsTheirWorkIsWorth)
{
    ParallelLoops workers(8);
    const auto expectTasks = [&](unsigned tasks) { EXPECT_EQ(workers.tasksFor(1000000, 1), tasks); };
    expectTasks(8);
    workers.runRegion(5.5 * ParallelLoops::workPerThread,
                      [&]
                      {
                          expectTasks(5);
                          workers.limit(2 * ParallelLoops::workPerThread);
                          expectTasks(2);
                          workers.limit(100 * ParallelLoops::workPerThread);
                          expectTasks(8);
                          workers.limit(0);
                          expectTasks(1);
                      });
    expectTasks(8);
    const auto fail = [] { throw std::bad_alloc(); };
    EXPECT_THROW(workers.runRegion(0.0, fail), std::bad_alloc);
    expectTasks(8);
}

TEST(ParallelLoops, UsesNoMoreThreadsThanMachineHasCores)
{
    ParallelLoops workers(64);
    std::mutex mutex;
    std::set<std::thread::id> threads;
    for (int loop = 0; loop < 20; ++loop)
        workers.run(1000,
                    [&](unsigned)
                    {
                        const std::lock_guard<std::mutex> lock(mutex);
                        threads.insert(std::this_thread::get_id());
                    });
    EXPECT_EQ(workers.threads(), 64u);
    EXPECT_LE(threads.size(), std::max(1u, std::thread::hardware_concurrency()));
}
}  // namespace
}  // namespace cullet::test
