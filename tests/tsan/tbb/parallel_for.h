// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

/// A stand-in for oneTBB's loop; tbb/task_arena.h beside this file says why.

#pragma once

#include <atomic>
#include <exception>
#include <mutex>
#include <tbb/task_arena.h>
#include <thread>
#include <vector>

namespace tbb
{

struct auto_partitioner
{
};
struct simple_partitioner
{
};
struct static_partitioner
{
};

/// Calls body(i) for i in [first, last), each once, on all threads of the arena; a loop inside a loop runs in place.
///
/// The counter is relaxed on purpose: taking a task orders nothing, so that two tasks that share data are a race even when
/// one of them happens to start after the other.
template <class Index, class Body, class Partitioner = auto_partitioner>
void parallel_for(Index first, Index last, const Body& body, const Partitioner& = {})
{
    const stand_in::Place caller = stand_in::place();
    if (!(first < last))
        return;
    if (caller.isInLoop)
    {
        for (Index i = first; i < last; ++i)
            body(i);
        return;
    }

    std::atomic<Index> next{first};
    std::mutex failureMutex;
    std::exception_ptr failure;
    const int concurrency = this_task_arena::max_concurrency();
    const auto work = [&](int index)
    {
        const stand_in::PlaceScope scope({concurrency, index, true});
        try
        {
            for (Index i; (i = next.fetch_add(1, std::memory_order_relaxed)) < last;)
                body(i);
        }
        catch (...)
        {
            const std::lock_guard<std::mutex> lock(failureMutex);
            if (!failure)
                failure = std::current_exception();
        }
    };
    std::vector<std::thread> threads;
    for (int index = 1; index < concurrency && static_cast<Index>(index) < last - first; ++index)
        threads.emplace_back(work, index);
    work(0);
    for (std::thread& thread : threads)
        thread.join();
    if (failure)
        std::rethrow_exception(failure);
}

}  // namespace tbb
