// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/base/threads/staged_loop.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>
#include <vector>

namespace cullet::test
{
namespace
{
/// What ran, and in which order.
struct Record
{
    Record(unsigned parts, unsigned stages) : done(stages), runs(std::size_t{parts} * stages) {}

    std::vector<std::atomic<unsigned>> done;  ///< [stage] parts that are done
    std::vector<std::atomic<unsigned>> runs;  ///< [stage][part]
    std::atomic<unsigned> early{0};           ///< parts that began before the stage before was done
};

void runRecorded(StagedLoop& loop, ParallelLoops& loops, unsigned parts, unsigned stages, Record& record)
{
    loops.runRegion(
        [&]
        {
            loop.run(loops, parts, stages,
                     [&](unsigned stage, unsigned part, unsigned thread)
                     {
                         EXPECT_LT(thread, loops.threads());
                         if (stage > 0 && record.done[stage - 1] != parts)
                             ++record.early;
                         ++record.runs[std::size_t{stage} * parts + part];
                         ++record.done[stage];
                     });
        });
}

void expectAllRunOnceInOrder(const Record& record)
{
    EXPECT_EQ(record.early, 0u);
    for (const std::atomic<unsigned>& runs : record.runs)
        ASSERT_EQ(runs, 1u);
}

TEST(StagedLoop, RunsPartsOfStageAfterAllOfStageBefore)
{
    StagedLoop loop;
    for (const int threads : {1, 2, 3, 8})
    {
        ParallelLoops loops(threads);
        for (const unsigned parts : {1u, 2u, 3u, 8u, 20u})
        {
            SCOPED_TRACE(testing::Message() << threads << " threads, " << parts << " parts");
            Record record(parts, 300);
            runRecorded(loop, loops, parts, 300, record);
            expectAllRunOnceInOrder(record);
        }
    }
}

TEST(StagedLoop, RunsNothingWithoutStages)
{
    StagedLoop loop;
    ParallelLoops loops(2);
    int runs = 0;
    loops.runRegion([&] { loop.run(loops, 2, 0, [&](unsigned, unsigned, unsigned) { ++runs; }); });
    EXPECT_EQ(runs, 0);
}

TEST(StagedLoop, SeesWhatStageBeforeWroteWithoutAtomics)
{
    constexpr unsigned kParts = 4, kStages = 200;
    StagedLoop loop;
    ParallelLoops loops(4);
    // Each part adds up what all parts had in the stage before.
    std::vector<std::vector<std::uint32_t>> sums(kStages, std::vector<std::uint32_t>(kParts, 1));
    const auto addUp = [&](unsigned stage, unsigned part, unsigned)
    {
        std::uint32_t sum = part;
        for (unsigned i = 0; stage > 0 && i < kParts; ++i)
            sum = sum * 31 + sums[stage - 1][i];
        sums[stage][part] = sum;
    };
    loops.runRegion([&] { loop.run(loops, kParts, kStages, addUp); });
    const auto inParallel = sums;
    for (unsigned stage = 0; stage < kStages; ++stage)
    {
        for (unsigned part = 0; part < kParts; ++part)
            addUp(stage, part, 0);
    }
    EXPECT_EQ(inParallel, sums);
}

TEST(StagedLoop, RunsPartsOfThreadThatStaysAway)
{
    StagedLoop loop;
    ParallelLoops loops(2);
    Record record(2, 50);
    // While the second thread sleeps between two stages, if it has joined.
    std::atomic<bool> hasSlept{false};
    loops.runRegion(
        [&]
        {
            loop.run(loops, 2, 50,
                     [&](unsigned stage, unsigned part, unsigned thread)
                     {
                         if (thread == 1 && !hasSlept.exchange(true))
                             std::this_thread::sleep_for(std::chrono::milliseconds(5));
                         ++record.runs[std::size_t{stage} * 2 + part];
                     });
        });
    expectAllRunOnceInOrder(record);
}
}  // namespace
}  // namespace cullet::test
