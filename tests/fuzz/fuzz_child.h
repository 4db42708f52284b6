// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/fuzz/fuzz_target.h"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <functional>
#include <string>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace cullet::test
{
using Bytes = std::vector<std::uint8_t>;

inline constexpr std::size_t kMaxInputBytes = std::size_t{1} << 20;

enum class FuzzOutcome
{
    Holds,
    Wrong,    ///< the oracle differs
    Crashed,  ///< a signal, or a sanitizer's exit
    Hung
};

/// Runs inputs in a child process, so that the ends of processes are findings as well.
class FuzzChild
{
public:
    FuzzChild()
    {
        void* memory =
            mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
        if (memory == MAP_FAILED)
        {
            std::perror("mmap");
            std::exit(2);
        }
        m_shared = static_cast<Shared*>(memory);
    }
    FuzzChild(const FuzzChild&) = delete;
    FuzzChild& operator=(const FuzzChild&) = delete;
    ~FuzzChild() { munmap(m_shared, sizeof(Shared)); }

    /// Runs inputs until one fails.
    ///
    /// @param make    make(i) returns the input for i in [0, count); called in the child
    /// @param isQuiet whether what the child prints is dropped
    /// @param isOver  asked before each input, in the child; the rest is left out where it is true
    FuzzOutcome run(std::size_t count, const std::function<Bytes(std::size_t)>& make, bool isQuiet,
                    const std::function<bool()>& isOver = nullptr)
    {
        m_shared->message[0] = 0;
        m_shared->size = 0;
        std::fflush(nullptr);
        const pid_t child = fork();
        if (child < 0)
        {
            std::perror("fork");
            std::exit(2);
        }
        if (child == 0)
            _exit(runInside(count, make, isQuiet, isOver));
        int status = 0;
        waitpid(child, &status, 0);
        return outcomeOf(status);
    }

    /// The input that failed, and how.
    Bytes input() const { return {m_shared->input, m_shared->input + m_shared->size}; }
    const std::string& message() const { return m_message; }

    /// Of all runs.
    std::uint64_t cases() const { return m_shared->cases; }
    std::uint64_t operations() const { return m_shared->operations; }

private:
    static constexpr int kWrongExit = 77;
    static constexpr unsigned kSecondsPerInput = 300;

    struct Shared
    {
        std::uint64_t cases, operations;
        std::size_t size;
        char message[4096];
        std::uint8_t input[kMaxInputBytes];
    };

    int runInside(std::size_t count, const std::function<Bytes(std::size_t)>& make, bool isQuiet,
                  const std::function<bool()>& isOver)
    {
        const int nowhere = isQuiet ? open("/dev/null", O_WRONLY) : -1;
        if (nowhere >= 0)
        {
            dup2(nowhere, STDOUT_FILENO);
            dup2(nowhere, STDERR_FILENO);
        }
        for (std::size_t i = 0; i < count && !(isOver && isOver()); ++i)
        {
            const Bytes bytes = make(i);
            m_shared->size = std::min(bytes.size(), kMaxInputBytes);
            std::copy_n(bytes.begin(), m_shared->size, m_shared->input);
            alarm(kSecondsPerInput);
            const std::string fault = runFuzzInput(bytes.data(), m_shared->size);
            alarm(0);
            ++m_shared->cases;
            m_shared->operations += (m_shared->size + kOperationBytes - 1) / kOperationBytes;
            if (fault.empty())
                continue;
            std::snprintf(m_shared->message, sizeof m_shared->message, "%s", fault.c_str());
            return kWrongExit;
        }
        return 0;
    }

    FuzzOutcome outcomeOf(int status)
    {
        m_message = m_shared->message;
        if (WIFEXITED(status) && WEXITSTATUS(status) == 0)
            return FuzzOutcome::Holds;
        if (WIFEXITED(status) && WEXITSTATUS(status) == kWrongExit)
            return FuzzOutcome::Wrong;
        if (WIFEXITED(status))
        {
            m_message = "process exits with " + std::to_string(WEXITSTATUS(status));
            return FuzzOutcome::Crashed;
        }
        m_message = "process ends by signal " + std::to_string(WTERMSIG(status));
        return WTERMSIG(status) == SIGALRM ? FuzzOutcome::Hung : FuzzOutcome::Crashed;
    }

    Shared* m_shared;
    std::string m_message;
};
}  // namespace cullet::test
