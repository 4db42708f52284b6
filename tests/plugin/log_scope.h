// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/log.h"

#include <string>
#include <vector>

namespace cullet::test
{
/// Warnings and errors since the last LogScope began.
inline std::vector<std::string>& loggedLines()
{
    static std::vector<std::string> lines;
    return lines;
}

/// Collects warnings and errors for a scope.
class LogScope
{
public:
    LogScope()
    {
        loggedLines().clear();
        setLogFunction(
            [](LogLevel level, const char* message)
            {
                if (level != LogLevel::Info)
                    loggedLines().emplace_back(message);
            });
    }
    ~LogScope() { setLogFunction(nullptr); }
    LogScope(const LogScope&) = delete;
    LogScope& operator=(const LogScope&) = delete;
};
}  // namespace cullet::test
