// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdarg>
#include <cstdio>
#include <unistd.h>

namespace cullet::preload
{
/// One line on stderr, past the program's own buffers, with the process it is about.
[[gnu::format(printf, 1, 2)]] inline void say(const char* format, ...)
{
    char text[512];
    std::va_list values;
    va_start(values, format);
    std::vsnprintf(text, sizeof(text), format, values);
    va_end(values);
    dprintf(STDERR_FILENO, "cullet[%d]: %s\n", static_cast<int>(getpid()), text);
}
}  // namespace cullet::preload
