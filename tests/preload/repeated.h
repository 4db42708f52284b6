// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdio>
#include <malloc.h>
#include <thread>
#include <vector>

namespace cullet::test
{
/// Calls a function that makes and destroys things twice, and prints the bytes in use that are left of the second call.
template <class MakeSome>
void printBytesLeft(const MakeSome& makeSome)
{
    makeSome();
    const auto before = mallinfo2().uordblks;
    makeSome();
    std::printf("left %ld\n", static_cast<long>(mallinfo2().uordblks) - static_cast<long>(before));
}

template <class Run>
void runInFourThreads(const Run& run)
{
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
        threads.emplace_back(run);
    for (std::thread& thread : threads)
        thread.join();
}
}  // namespace cullet::test
