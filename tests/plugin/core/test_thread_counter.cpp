// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/core/thread_counter.h"
#include "cullet/tests/support/threads.h"

#include <gtest/gtest.h>

#include <atomic>

namespace cullet::test
{
namespace
{
TEST(ThreadCounter, LosesNoCountWhenThreadsAddAtOnce)
{
    constexpr int kThreads = 4;
    constexpr std::uint64_t kAdditions = 3000000;
    ThreadCounter counter;
    counter.add(7);
    counter.reset();
    EXPECT_EQ(counter.value(), 0u);
    std::atomic<int> waiting{kThreads};
    onThreads(kThreads,
              [&](int)
              {
                  --waiting;
                  while (waiting > 0)
                      std::this_thread::yield();
                  for (std::uint64_t i = 0; i < kAdditions; ++i)
                      counter.add(1);
              });
    EXPECT_EQ(counter.value(), kThreads * kAdditions);
}
}  // namespace
}  // namespace cullet::test
