// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdio>
#include <unistd.h>

namespace cullet::preload
{
/// One line on stderr, past the program's own buffers, with the process it is about.
template <class... Values>
void say(const char* format, Values... values)
{
    char text[512];
    std::snprintf(text, sizeof(text), format, values...);
    dprintf(STDERR_FILENO, "cullet[%d]: %s\n", static_cast<int>(getpid()), text);
}
}  // namespace cullet::preload
