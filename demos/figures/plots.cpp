// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/figures/plots.h"

#include <cstdio>
#include <spawn.h>
#include <sys/wait.h>

extern char** environ;

namespace cullet
{
namespace
{
// Debian's python3 instead of the one in PATH, since it finds Debian's packages.
constexpr const char* kPython = "/usr/bin/python3";
constexpr const char* kScript = CULLET_DEMOS_FOLDER "/plots/plot.py";

/// @return exit status, or -1 when the program could not be started
int runProgram(const std::vector<std::string>& words)
{
    std::vector<char*> arguments;
    for (const std::string& word : words)
        arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    pid_t child = 0;
    if (posix_spawn(&child, arguments[0], nullptr, nullptr, arguments.data(), environ) != 0)
        return -1;
    int status = 0;
    if (waitpid(child, &status, 0) != child || !WIFEXITED(status))
        return -1;
    return WEXITSTATUS(status);
}
}  // namespace

bool drawFigures(const std::string& folder, const std::vector<std::string>& names)
{
    std::vector<std::string> words = {kPython, kScript, "--figures", folder};
    words.insert(words.end(), names.begin(), names.end());
    const int status = runProgram(words);
    if (status == 0)
        return true;
    if (status < 0 || status == 127)
        std::fprintf(stderr, "cullet: %s could not be started (Debian: apt install python3-matplotlib)\n",
                     kPython);
    std::fprintf(stderr,
                 "cullet: no plots; the measured data are in %s, and '%s %s --figures %s' draws them\n",
                 folder.c_str(), kPython, kScript, folder.c_str());
    return false;
}
}  // namespace cullet
