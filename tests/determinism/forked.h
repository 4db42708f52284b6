// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/determinism/history.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <sys/wait.h>
#include <unistd.h>

namespace cullet::test
{
/// A process that computes a history while its parent goes on.
class ForkedHistory
{
public:
    /// Forks. An alarm ends the child when it hangs.
    ///
    /// @param compute called in the child; returns the history
    template <class Compute>
    explicit ForkedHistory(const Compute& compute)
    {
        int ends[2];
        if (pipe(ends) != 0)
            return;
        m_from = ends[0];
        m_child = fork();
        if (m_child != 0)
        {
            close(ends[1]);
            return;
        }
        alarm(kSeconds);
        const History history = compute();
        const std::size_t bytes = history.size() * sizeof(Fingerprint);
        const bool isWhole = write(ends[1], history.data(), bytes) == static_cast<ssize_t>(bytes);
        _exit(isWhole && !testing::Test::HasFailure() ? 0 : 1);
    }
    ~ForkedHistory()
    {
        if (m_child > 0)
            wait();
    }
    ForkedHistory(const ForkedHistory&) = delete;
    ForkedHistory& operator=(const ForkedHistory&) = delete;

    /// Waits for the child. Fails the test unless it ended well.
    History wait()
    {
        EXPECT_GT(m_child, 0) << "no child";
        History history;
        Fingerprint next;
        while (read(m_from, &next, sizeof next) == static_cast<ssize_t>(sizeof next))
            history.push_back(next);
        close(m_from);
        int status = -1;
        waitpid(m_child, &status, 0);
        EXPECT_EQ(status, 0) << (WIFSIGNALED(status) ? "ended by signal " + std::to_string(WTERMSIG(status))
                                                     : "failed");
        m_child = -1;
        return history;
    }

private:
    /// Far more than a history takes.
    static constexpr unsigned kSeconds = 120;

    pid_t m_child = -1;
    int m_from = -1;
};
}  // namespace cullet::test
