// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

/// A stand-in for oneTBB's groups of tasks; tbb/task_arena.h beside this file says why.

#pragma once

#include <thread>
#include <utility>
#include <vector>

namespace tbb
{

/// Each task is a thread of its own. Tasks may not throw.
class task_group
{
public:
    task_group() = default;
    ~task_group() { wait(); }
    task_group(const task_group&) = delete;
    task_group& operator=(const task_group&) = delete;

    template <class Function>
    void run(Function&& function)
    {
        m_threads.emplace_back(std::forward<Function>(function));
    }

    void wait()
    {
        for (std::thread& thread : m_threads)
            thread.join();
        m_threads.clear();
    }

private:
    std::vector<std::thread> m_threads;
};

}  // namespace tbb
