// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/interrupt.h"

#include "cullet/demos/program/system.h"

#include <csignal>
#include <cstdint>
#include <ctime>

namespace cullet
{
namespace
{
// `timeout` and job runners send a signal to the process and again to its group, microseconds later: these count as one
// request.
constexpr std::int64_t kSameRequestNanoseconds = 200'000'000;

volatile std::sig_atomic_t interruptCount = 0;
volatile std::int64_t firstNanoseconds = 0;

std::int64_t now()
{
    timespec time = {};
    clock_gettime(CLOCK_MONOTONIC, &time);
    return std::int64_t(time.tv_sec) * 1'000'000'000 + time.tv_nsec;
}

// Calls only what POSIX allows in a handler.
void onSignal(int signal)
{
    if (interruptCount == 0)
    {
        firstNanoseconds = now();
        interruptCount = 1;
    }
    else if (now() - firstNanoseconds > kSameRequestNanoseconds)
    {
        std::signal(signal, SIG_DFL);
        std::raise(signal);
    }
}
}  // namespace

void catchInterrupts()
{
    onInterruptSignals(onSignal);
}

bool isInterrupted() noexcept
{
    return interruptCount != 0;
}
}  // namespace cullet
