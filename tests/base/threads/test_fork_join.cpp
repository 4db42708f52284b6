// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/base/threads/fork_join.h"
#include "cullet/base/threads/parallel_loops.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cfenv>
#include <chrono>
#include <new>
#include <set>
#include <thread>
#include <vector>

#if defined(__linux__)
#include <sys/resource.h>
#endif

namespace cullet::test
{
namespace
{
using Clock = std::chrono::steady_clock;

/// A thread that rejoins each time it leaves.
class Helper
{
public:
    explicit Helper(ForkJoin& crew)
        : m_thread(
              [this, &crew]
              {
                  while (!m_isOver.load())
                      crew.help();
              })
    {
    }
    ~Helper()
    {
        m_isOver.store(true);
        m_thread.join();
    }

private:
    std::atomic<bool> m_isOver{false};
    std::thread m_thread;
};

/// A loop of two tasks that wait for each other: it needs two threads.
void meet(ForkJoin& crew)
{
    std::atomic<int> there{0};
    crew.run(2,
             [&](unsigned, unsigned)
             {
                 ++there;
                 while (there.load() < 2)
                     std::this_thread::yield();
             });
}

TEST(ForkJoin, ComputesInRoundingModeOfCallingThread)
{
    ForkJoin crew(2);
    crew.open();
    Helper helper(crew);
    meet(crew);
    const volatile double one = 1, three = 3;
    std::set<double> thirds;
    for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TONEAREST})
    {
        ASSERT_EQ(std::fesetround(mode), 0);
        const double third = one / three;
        thirds.insert(third);
        std::atomic<int> there{0}, asCaller{0};
        crew.run(2,
                 [&](unsigned, unsigned)
                 {
                     asCaller += one / three == third ? 1 : 0;
                     for (++there; there.load() < 2;)
                         std::this_thread::yield();
                 });
        EXPECT_EQ(asCaller, 2) << mode;
        EXPECT_EQ(std::fegetround(), mode);
    }
    crew.close();
    EXPECT_EQ(thirds.size(), 2u) << "the modes make no difference";
}

TEST(ForkJoin, KeepsFloatingPointFlagsThatTasksOfCallingThreadRaise)
{
    ForkJoin crew(1);
    crew.open();
    std::feclearexcept(FE_ALL_EXCEPT);
    crew.run(2,
             [](unsigned task, unsigned)
             {
                 if (task == 0)
                     std::feraiseexcept(FE_OVERFLOW);
             });
    crew.close();
    EXPECT_NE(std::fetestexcept(FE_OVERFLOW), 0);
    std::feclearexcept(FE_ALL_EXCEPT);
}

TEST(ForkJoin, RunsEachTaskOfEachLoopOnce)
{
    ForkJoin crew(3);
    crew.open();
    Helper first(crew);
    Helper second(crew);
    meet(crew);
    std::vector<unsigned> counts(100);
    for (unsigned loop = 1; loop <= 2000; ++loop)
    {
        // Writes between and before loops are visible without further synchronisation.
        const unsigned tasks = loop % 100 + 1;
        crew.run(tasks, [&](unsigned task, unsigned) { counts[task] = loop + task; });
        for (unsigned task = 0; task < tasks; ++task)
            counts[task] -= task;
        crew.run(tasks, [&](unsigned task, unsigned) { ++counts[task]; });
        for (unsigned task = 0; task < tasks; ++task)
            ASSERT_EQ(counts[task], loop + 1) << "loop " << loop << ", task " << task;
    }
    crew.close();
}

TEST(ForkJoin, CompletesLoopWithoutHelperAndReusesNumberOfOneThatLeft)
{
    ForkJoin crew(2);
    crew.open();
    unsigned count = 0;
    crew.run(5, [&](unsigned task, unsigned) { count += task; });
    EXPECT_EQ(count, 10u);
    // A thread joins, finds no task and leaves; its number is free again.
    crew.help();
    const Helper next(crew);
    meet(crew);
    crew.close();
}

TEST(ForkJoin, LetsNoTwoThreadsShareNumberWhenTooManyHelp)
{
    ForkJoin crew(2);
    crew.open();
    const Helper first(crew), second(crew), third(crew);
    meet(crew);
    std::atomic<bool> isBusy[2] = {};
    std::atomic<bool> isShared{false};
    for (int loop = 0; loop < 300; ++loop)
        crew.run(20,
                 [&](unsigned, unsigned thread)
                 {
                     if (isBusy[thread].exchange(true))
                         isShared.store(true);
                     for (const auto begin = Clock::now();
                          Clock::now() - begin < std::chrono::microseconds(10);)
                     {
                     }
                     isBusy[thread].store(false);
                 });
    EXPECT_FALSE(isShared.load());
    crew.close();
}

TEST(ForkJoin, RethrowsTaskExceptionInCallerAndRunsNextLoop)
{
    ForkJoin crew(2);
    crew.open();
    Helper helper(crew);
    for (int loop = 0; loop < 100; ++loop)
    {
        std::atomic<int> there{0};
        const auto failInBoth = [&](unsigned, unsigned)
        {
            ++there;
            while (there.load() < 2)
                std::this_thread::yield();
            throw std::bad_alloc();
        };
        EXPECT_THROW(crew.run(2, failInBoth), std::bad_alloc);
        meet(crew);
    }
    crew.close();
}

#if defined(__linux__)
/// How often the calling thread has given up its core to wait; yielding does not count.
long sleepsOfThisThread()
{
    rusage usage = {};
    getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_nvcsw;
}

TEST(ForkJoin, SleepsInsteadOfSpinningWhenAWaitIsLong)
{
    const long before = sleepsOfThisThread();
    for (unsigned spins = 0; spins < ForkJoin::kMostSpins + 10; ++spins)
        ForkJoin::spinWait(spins);
    EXPECT_EQ(sleepsOfThisThread(), before) << "short waits end without the system";
    for (unsigned spins = 1000; spins < 1010; ++spins)
        ForkJoin::spinWait(spins);
    EXPECT_GE(sleepsOfThisThread() - before, 10);
}
#endif

TEST(ParallelLoops, RunsAllTasksInOneRegionAndRethrowsExceptions)
{
    ParallelLoops workers(3);
    std::vector<unsigned> counts(1000);
    std::vector<unsigned> owners(3);
    const auto countAll = [&]
    {
        for (int loop = 0; loop < 50; ++loop)
        {
            workers.run(1000, [&](unsigned task) { ++counts[task]; });
            workers.run(7,
                        [&](unsigned task, unsigned thread)
                        {
                            ++owners.at(thread);
                            workers.run(2, [&](unsigned inner) { counts[2 * task + inner] += 1; });
                        });
        }
    };
    workers.runRegion(countAll);
    EXPECT_EQ(owners[0] + owners[1] + owners[2], 350u);
    for (unsigned i = 0; i < counts.size(); ++i)
        ASSERT_EQ(counts[i], i < 14 ? 100u : 50u) << i;
    const auto fail = [&] { workers.run(4, [](unsigned) { throw std::bad_alloc(); }); };
    EXPECT_THROW(workers.runRegion(fail), std::bad_alloc);
    workers.run(1000, [&](unsigned task) { ++counts[task]; });
    workers.runRegion(countAll);
    EXPECT_EQ(counts.back(), 101u);
}
}  // namespace
}  // namespace cullet::test
