// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/precision.h"

#include "cullet/demos/program/exit_code.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <unistd.h>

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
/// The name of the program in the other precision: NAME or NAME-float64.
std::string siblingOf(std::string name)
{
    const std::string suffix = "-float64";
    const bool isDouble =
        name.size() > suffix.size() && name.compare(name.size() - suffix.size(), suffix.size(), suffix) == 0;
    return isDouble ? name.substr(0, name.size() - suffix.size()) : name + suffix;
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
    std::error_code error;
    const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
    const std::filesystem::path sibling = self.parent_path() / siblingOf(self.filename().string());
    execv(sibling.c_str(), argv);
    throw ProgramError(kExitUnavailable, "precision " + wanted + " needs the program '" + sibling.string() +
                                             "', which cannot be started: " + std::strerror(errno));
}
}  // namespace cullet
