// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdarg>
#include <cstdio>
#include <unistd.h>

namespace cullet::preload
{
/// Writes one line with the process id to stderr, bypassing the program's own buffers.
[[gnu::format(printf, 1, 2)]] inline void printLine(const char* format, ...)
{
    char text[512];
    std::va_list values;
    va_start(values, format);
    std::vsnprintf(text, sizeof(text), format, values);
    va_end(values);
    dprintf(STDERR_FILENO, "cullet[%d]: %s\n", static_cast<int>(getpid()), text);
}
}  // namespace cullet::preload
