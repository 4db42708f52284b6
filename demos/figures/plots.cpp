// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/figures/plots.h"

#include "cullet/demos/program/system.h"

#include <cstdio>

namespace cullet
{
namespace
{
// Debian's python3 instead of the one in PATH, since it finds Debian's packages.
constexpr const char* kPython = "/usr/bin/python3";
constexpr const char* kScript = CULLET_DEMOS_FOLDER "/plots/plot.py";
}  // namespace

bool drawFigures(const std::string& folder, const std::vector<std::string>& names)
{
    std::vector<std::string> words = {kPython, kScript, "--figures", folder};
    words.insert(words.end(), names.begin(), names.end());
    const int status = runProgram(words, ChildOutput::Shown);
    if (status == 0)
        return true;
    if (status == 127)
        std::fprintf(stderr, "cullet: %s could not be started (Debian: apt install python3-matplotlib)\n",
                     kPython);
    std::fprintf(stderr,
                 "cullet: no plots; the measured data are in %s, and '%s %s --figures %s' draws them\n",
                 folder.c_str(), kPython, kScript, folder.c_str());
    return false;
}
}  // namespace cullet
