// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The same program as other processes: where the system puts it, what its C library chooses and how many cores it gets
// changes no bit.
#include "cullet/tests/determinism/hash_ledger.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
using Lines = std::vector<std::string>;

/// What cullet_histories prints when started by a command; no line if that fails.
Lines histories(const std::string& command)
{
    FILE* const pipe = popen((command + " " CULLET_HISTORIES " 2>&1").c_str(), "r");
    Lines lines;
    char line[512];
    while (pipe != nullptr && std::fgets(line, sizeof line, pipe) != nullptr)
        lines.emplace_back(line);
    return pipe != nullptr && pclose(pipe) == 0 ? lines : Lines();
}

/// Without worlds whose bodies Bullet turns with the sine and cosine of the C library.
Lines promisedOnEveryMachine(const Lines& lines)
{
    Lines promised;
    for (const std::string& line : lines)
        if (line.rfind("pour", 0) != 0)
            promised.push_back(line);
    return promised;
}

/// Whether the command line can start a program at all.
bool canStart(const std::string& command)
{
    return std::system((command + " true >/dev/null 2>&1").c_str()) == 0;
}

void expectSameLines(const Lines& expected, const Lines& actual, const std::string& how)
{
    ASSERT_EQ(actual.size(), expected.size()) << how;
    for (std::size_t i = 0; i < expected.size(); ++i)
    {
        std::istringstream wanted(expected[i]), found(actual[i]);
        std::string wantedWord, foundWord;
        while (wanted >> wantedWord && found >> foundWord)
        {
            if (wantedWord.size() == 16)
                HashLedger::instance().expectSame("processes", std::strtoull(wantedWord.c_str(), nullptr, 16),
                                                  std::strtoull(foundWord.c_str(), nullptr, 16),
                                                  how + ": " + expected[i]);
        }
    }
}

TEST(DeterminismOfProcesses, GivesSameBitsInEveryProcess)
{
    const Lines expected = histories("env");
    ASSERT_EQ(expected.size(), 11u);
    for (const char* const command : {
             "env",
             "setarch -R",
             "taskset -c 0",
             "env MALLOC_PERTURB_=165",
             "env MALLOC_ARENA_MAX=1 MALLOC_TOP_PAD_=1000000",
             "env -i FILLER=$(printf '%05000d' 0)",
         })
    {
        if (canStart(command))
            expectSameLines(expected, histories(command), command);
        else
            std::printf("not varied, since the system refuses it: %s\n", command);
    }
    // Debian 12's sine has the same bits with and without FMA, that of glibc 2.39 has not.
    const char* const withoutFma =
        "env GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F,-AVX512VL,-ERMS";
    expectSameLines(promisedOnEveryMachine(expected), promisedOnEveryMachine(histories(withoutFma)),
                    withoutFma);
}
}  // namespace
}  // namespace cullet::test
