// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"

namespace cullet
{
enum class LogLevel
{
    Info,
    Warning,
    Error
};

/// Receives one line without a line feed; valid during the call only. It may be called from any thread.
using LogFunction = void (*)(LogLevel level, const char* message);

/// Sends messages to `function`; null brings the default back, which prints warnings and errors to stderr.
///
/// Nothing is logged per step or per pair: numbers are in the statistics.
CULLET_API void setLogFunction(LogFunction function) noexcept;

CULLET_API void log(LogLevel level, const char* message) noexcept;

/// Receives a broken contract: the condition, what to do about it, and where. Return true to stop in the debugger.
using AssertHandler = bool (*)(const char* condition, const char* hint, const char* file, int line);

/// Replaces the handler of CULLET_ASSERT; null brings the default back, which logs an error and stops.
CULLET_API void setAssertHandler(AssertHandler handler) noexcept;

CULLET_API bool reportAssertion(const char* condition, const char* hint, const char* file, int line) noexcept;
}  // namespace cullet

/// Checks what a caller has promised. Release builds (NDEBUG) do not evaluate the condition: there the broken promise
/// has a defined outcome, which the function's description names.
#ifdef NDEBUG
#define CULLET_ASSERT(condition, hint) static_cast<void>(0)
#else
#define CULLET_ASSERT(condition, hint)                                                       \
    do                                                                                       \
    {                                                                                        \
        if (!(condition) && ::cullet::reportAssertion(#condition, hint, __FILE__, __LINE__)) \
            __builtin_trap();                                                                \
    } while (false)
#endif
