// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/precision.h"

#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/system.h"

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace cullet
{
namespace
{
std::string findRequestedPrecision(int argc, char** argv)
{
    constexpr const char* kOption = "--precision";
    const std::size_t length = std::strlen(kOption);
    for (int i = 1; i < argc; ++i)
    {
        if (std::strncmp(argv[i], kOption, length) != 0)
            continue;
        if (argv[i][length] == '=')
            return argv[i] + length + 1;
        if (argv[i][length] == '\0' && i + 1 < argc)
            return argv[i + 1];
    }
    return ownPrecision();
}
/// Removes an ending, if the name has it and is longer.
bool takeEnding(std::string& name, const std::string& ending)
{
    if (name.size() <= ending.size() || name.compare(name.size() - ending.size(), ending.size(), ending) != 0)
        return false;
    name.resize(name.size() - ending.size());
    return true;
}

/// The name of the program in the other precision: NAME or NAME-float64, with .exe where this one has it.
std::string siblingOf(std::string name)
{
    const std::string suffix = "-float64";
    const std::string extension = takeEnding(name, ".exe") ? ".exe" : "";
    return (takeEnding(name, suffix) ? name : name + suffix) + extension;
}
}  // namespace

std::string ownPrecision()
{
#ifdef BT_USE_DOUBLE_PRECISION
    return "double";
#else
    return "float";
#endif
}

void switchPrecision(int argc, char** argv)
{
    const std::string wanted = findRequestedPrecision(argc, argv);
    if (wanted == ownPrecision() || (wanted != "float" && wanted != "double"))
        return;
    const std::filesystem::path self = pathOfThisProgram();
    const std::filesystem::path sibling = self.parent_path() / siblingOf(self.filename().string());
    becomeProgram(sibling, argv);
    throw ProgramError(kExitUnavailable, "precision " + wanted + " needs the program '" + sibling.string() +
                                             "', which cannot be started: " + std::strerror(errno));
}
}  // namespace cullet
