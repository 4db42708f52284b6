// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/machine.h"

#include "cullet/demos/program/system.h"
#include "cullet/generated/commit.h"

#include <cstdio>
#include <filesystem>
#include <fstream>

namespace cullet
{
namespace
{
/// The value of the first line "key : value" of a file of /proc; empty if there is none.
std::string readField(const std::filesystem::path& path, const std::string& key)
{
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);)
    {
        if (line.compare(0, key.size(), key) != 0)
            continue;
        const std::size_t start = line.find_first_not_of(" \t", line.find(':') + 1);
        return start == std::string::npos ? "" : line.substr(start);
    }
    return "";
}

std::string findGpu()
{
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/driver/nvidia/gpus", error))
        return readField(entry.path() / "information", "Model");
    return "";
}

std::string findInstructions()
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") != 0)
        return "AVX-512";
    if (__builtin_cpu_supports("avx2") != 0)
        return "AVX2";
#endif
    return "baseline";
}
}  // namespace

Machine describeMachine()
{
    Machine machine;
    machine.cpu = readField("/proc/cpuinfo", "model name");
    machine.instructions = findInstructions();
    machine.cores = usableCores();
    machine.memoryGib = memoryGib();
    machine.gpu = findGpu();
    machine.system = nameOfSystem();
#ifdef __clang__
    machine.compiler = "clang " __clang_version__;
#else
    machine.compiler = "gcc " __VERSION__;
#endif
    machine.buildType = CULLET_BUILD_TYPE;
    return machine;
}

std::string toLine(const Machine& machine)
{
    char text[512];
    std::snprintf(text, sizeof(text), "%s, %s, %d %s, %.1f GiB, %s%s%s, %s", machine.cpu.c_str(),
                  machine.instructions.c_str(), machine.cores, machine.cores == 1 ? "core" : "cores",
                  machine.memoryGib, machine.gpu.c_str(), machine.gpu.empty() ? "" : ", ",
                  machine.compiler.c_str(), machine.buildType.c_str());
    return text;
}

const char* builtCommit() noexcept
{
    return CULLET_COMMIT;
}

bool isDebugBuild() noexcept
{
#ifdef NDEBUG
    return false;
#else
    return true;
#endif
}
}  // namespace cullet
