// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/sanitizer.h"
#include "cullet/broad/log.h"
#include "cullet/tests/faults/support/faults.h"
#include "cullet/tests/support/process/failing_new.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <new>

namespace cullet::test
{
/// One life of a scene, with at most one fault.
class FaultRun
{
public:
    /// Calls cullet. @return false if the fault left the call as an exception
    template <class Call>
    bool attempt(const Call& call)
    {
        try
        {
            const FaultScope scope;
            call();
            return true;
        }
        catch (const std::bad_alloc&)
        {
        }
        catch (const CallbackFault&)
        {
        }
        EXPECT_TRUE(hasFaultHappened()) << "an exception without a fault";
        ++m_thrown;
        return false;
    }

    /// Calls a function of cullet that promises to throw nothing.
    template <class Call>
    void certain(const Call& call)
    {
        const std::uint64_t before = m_thrown;
        EXPECT_TRUE(attempt(call)) << "an exception of a call that throws nothing";
        m_thrown = before;
    }

    /// Calls until it succeeds: a second failure would be no fault of this run.
    template <class Call>
    void insist(const Call& call)
    {
        if (!attempt(call))
        {
            EXPECT_TRUE(attempt(call)) << "the fault was over";
        }
    }

    /// Calls an update. Where the fault happens in it, an update that returns may lack some of its results if it logs
    /// a word; then the next one has them.
    ///
    /// @return whether the results are complete
    template <class Call>
    bool update(const Call& call)
    {
        const bool hadFailed = hasFaultHappened();
        const std::uint64_t words = loggedProblems();
        if (!attempt(call))
            return false;
        if (!hadFailed && hasFaultHappened() && loggedProblems() != words)
            certain(call);
        return true;
    }

    std::uint64_t thrown() const { return m_thrown; }

    /// Warnings and errors that cullet has logged.
    static std::uint64_t loggedProblems() noexcept { return problemCount().load(); }
    static void log(LogLevel level, const char*) { problemCount() += level != LogLevel::Info ? 1 : 0; }

private:
    static std::atomic<std::uint64_t>& problemCount() noexcept
    {
        static std::atomic<std::uint64_t> count{0};
        return count;
    }

    std::uint64_t m_thrown = 0;
};

/// The faults of one kind in one scene.
struct SweepCounts
{
    std::uint64_t injected = 0;
    std::uint64_t thrown = 0;  ///< that reached the caller as exceptions
};

/// A sweep lets every one of the first so many calls fail, and a sample of the others.
inline constexpr std::uint64_t kEveryOfMost = 2500, kEveryOfFew = 40;

/// The call that fails in the life after that in which the call number `after` has failed. With CULLET_FAULTS=all in
/// the environment every call fails once.
inline std::uint64_t nextFaultAfter(std::uint64_t after, std::uint64_t every)
{
    static const bool isComplete = std::getenv("CULLET_FAULTS") != nullptr;
    constexpr std::uint64_t kShare = 20;
    return after + 1 + (isComplete || after < every ? 0 : after / kShare);
}

/// Memory of operator new and of Bullet that is not freed.
inline std::int64_t liveMemory()
{
    return liveNewCount() + liveBulletCount();
}

/// Counts what must be left of a life with a dispatcher: all memory. Where a sanitizer watches, freed addresses are not used
/// again, and a registration stays for each address that a dispatcher ever had; the sanitizer looks for leaks itself.
template <std::int64_t (*Memory)() = liveMemory>
std::int64_t liveBesideDispatchers()
{
#ifdef CULLET_IS_SANITIZED
    return 0;
#else
    return Memory();
#endif
}

/// Lets one fault after the other happen in the life of a scene, until a life has none.
///
/// @param live      takes a FaultRun&, makes its objects, checks and destroys them
/// @param every     calls that fail one by one, before only a sample of them fails
/// @param memory    counts what must be as many after each life as before: by default all allocations
template <class Live>
SweepCounts sweepFaults(const char* scene, FaultKind kind, const Live& live,
                        std::uint64_t every = kEveryOfMost, std::int64_t (*memory)() = liveMemory)
{
    const auto liveOnce = [&](std::uint64_t after)
    {
        SCOPED_TRACE(testing::Message() << scene << ", " << nameOf(kind) << " fails after " << after);
        FaultRun run;
        live(run);
        return run.thrown();
    };
    setLogFunction(FaultRun::log);
    liveOnce(0);  // what lives as long as the process or the thread is made here
    liveOnce(0);
    const std::int64_t before = memory();
    SweepCounts counts;
    for (std::uint64_t after = 0; !testing::Test::HasFailure(); after = nextFaultAfter(after, every))
    {
        planFault(kind, after);
        const std::uint64_t thrown = liveOnce(after);
        const bool hasHappened = hasFaultHappened();
        cancelFault();
        // Once more without a fault: what threads keep for the next call may differ after one.
        if (memory() != before)
            liveOnce(after);
        EXPECT_EQ(memory(), before) << scene << ", " << nameOf(kind) << " fails after " << after
                                    << ": allocations are left";
        if (!hasHappened)
            break;
        ++counts.injected;
        counts.thrown += thrown;
    }
    setLogFunction(nullptr);
    std::printf("| %s | %s | %llu | %llu |\n", scene, nameOf(kind),
                static_cast<unsigned long long>(counts.injected),
                static_cast<unsigned long long>(counts.thrown));
    return counts;
}
}  // namespace cullet::test
