// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/log.h"

#include <atomic>
#include <cstdio>

namespace cullet
{
namespace
{
void printToStderr(LogLevel level, const char* message)
{
    if (level == LogLevel::Info)
        return;
    std::fprintf(stderr, "cullet: %s: %s\n", level == LogLevel::Error ? "error" : "warning", message);
}

bool logAndStop(const char* condition, const char* hint, const char* file, int line)
{
    char text[512];
    std::snprintf(text, sizeof(text), "%s:%d: '%s' does not hold; %s", file, line, condition, hint);
    log(LogLevel::Error, text);
    return true;
}

std::atomic<LogFunction> logFunction{printToStderr};
std::atomic<AssertHandler> assertHandler{logAndStop};
}  // namespace

void setLogFunction(LogFunction function) noexcept
{
    logFunction.store(function != nullptr ? function : printToStderr, std::memory_order_relaxed);
}

void log(LogLevel level, const char* message) noexcept
{
    logFunction.load(std::memory_order_relaxed)(level, message);
}

void setAssertHandler(AssertHandler handler) noexcept
{
    assertHandler.store(handler != nullptr ? handler : logAndStop, std::memory_order_relaxed);
}

bool reportAssertion(const char* condition, const char* hint, const char* file, int line) noexcept
{
    return assertHandler.load(std::memory_order_relaxed)(condition, hint, file, line);
}
}  // namespace cullet
