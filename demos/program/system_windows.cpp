// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/system.h"

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <process.h>
#include <thread>
#include <windows.h>

namespace cullet
{
namespace
{
/// A word as the C runtime of the child takes it apart: quoted, with backslashes before quotes doubled.
std::string quoted(const std::string& word)
{
    std::string result = "\"";
    std::size_t backslashes = 0;
    for (const char letter : word)
    {
        if (letter == '"')
            result.append(backslashes + 1, '\\');
        backslashes = letter == '\\' ? backslashes + 1 : 0;
        result += letter;
    }
    return result.append(backslashes, '\\') + "\"";
}

/// @return exit code; -1 if the program cannot be started
int startAndWait(std::vector<std::string> words, bool showsOutput)
{
    std::string line;
    for (const std::string& word : words)
        line += (line.empty() ? "" : " ") + quoted(word);
    STARTUPINFOA startup = {};
    startup.cb = sizeof startup;
    SECURITY_ATTRIBUTES inherited = {sizeof inherited, nullptr, TRUE};
    HANDLE nothing = INVALID_HANDLE_VALUE;
    if (!showsOutput)
    {
        nothing = CreateFileA("NUL", GENERIC_READ | GENERIC_WRITE, FILE_SHARE_READ | FILE_SHARE_WRITE,
                              &inherited, OPEN_EXISTING, 0, nullptr);
        startup.dwFlags = STARTF_USESTDHANDLES;
        startup.hStdInput = startup.hStdOutput = nothing;
        startup.hStdError = GetStdHandle(STD_ERROR_HANDLE);
    }
    PROCESS_INFORMATION child = {};
    const bool isStarted = CreateProcessA(nullptr, line.data(), nullptr, nullptr, TRUE, 0, nullptr, nullptr,
                                          &startup, &child) != FALSE;
    if (nothing != INVALID_HANDLE_VALUE)
        CloseHandle(nothing);
    if (!isStarted)
        return -1;
    WaitForSingleObject(child.hProcess, INFINITE);
    DWORD code = 0;
    GetExitCodeProcess(child.hProcess, &code);
    CloseHandle(child.hProcess);
    CloseHandle(child.hThread);
    return static_cast<int>(code);
}
}  // namespace

std::filesystem::path pathOfThisProgram()
{
    std::wstring path(32768, L'\0');
    path.resize(GetModuleFileNameW(nullptr, path.data(), static_cast<DWORD>(path.size())));
    return path;
}

int runProgram(const std::vector<std::string>& words, ChildOutput output)
{
    const int code = startAndWait(words, output == ChildOutput::Shown);
    return code == -1 ? 127 : code;
}

void becomeProgram(const std::filesystem::path& program, char** arguments)
{
    // exec() of Windows would return to the shell at once, while the other program still runs.
    std::vector<std::string> words = {program.string()};
    for (char** argument = arguments + 1; *argument != nullptr; ++argument)
        words.push_back(*argument);
    const int code = startAndWait(std::move(words), true);
    if (code != -1)
        std::exit(code);
    errno = ENOENT;
}

void onInterruptSignals(void (*handler)(int))
{
    std::signal(SIGINT, handler);
    std::signal(SIGTERM, handler);
}

int usableCores()
{
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

double memoryGib()
{
    MEMORYSTATUSEX memory = {};
    memory.dwLength = sizeof memory;
    GlobalMemoryStatusEx(&memory);
    return static_cast<double>(memory.ullTotalPhys) / (1024.0 * 1024.0 * 1024.0);
}

std::string nameOfSystem()
{
    return "Windows";
}
}  // namespace cullet
