// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/program/interrupt.h"

#include <csignal>

namespace cullet
{
namespace
{
volatile std::sig_atomic_t interruptCount = 0;

void onSignal(int)
{
    interruptCount = 1;
}
}  // namespace

void catchInterrupts()
{
    struct sigaction action = {};
    action.sa_handler = onSignal;
    // Once: the handler is gone when the second signal comes.
    action.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

bool isInterrupted() noexcept
{
    return interruptCount != 0;
}
}  // namespace cullet
