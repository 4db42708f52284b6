// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/program/precision.h"

#include "demos/program/exit_code.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <unistd.h>

namespace cullet
{
namespace
{
std::string findWantedPrecision(int argc, char** argv)
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
    const std::string wanted = findWantedPrecision(argc, argv);
    if (wanted == ownPrecision() || (wanted != "float" && wanted != "double"))
        return;
    const std::string name = wanted == "double" ? "cullet-float64" : "cullet";
    std::error_code error;
    const std::filesystem::path sibling =
        std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / name;
    execv(sibling.c_str(), argv);
    throw ProgramError(kExitUnavailable, "precision " + wanted + " needs the program '" + sibling.string() +
                                             "', which cannot be started: " + std::strerror(errno));
}
}  // namespace cullet
