// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <thread>
#include <vector>

namespace cullet::test
{
/// Calls body(i) for each i below the count at the same time, and waits for all of them.
template <class Count, class Body>
void onThreads(Count count, const Body& body)
{
    std::vector<std::thread> threads;
    for (Count i = 0; i < count; ++i)
        threads.emplace_back([&body, i] { body(i); });
    for (std::thread& thread : threads)
        thread.join();
}
}  // namespace cullet::test
