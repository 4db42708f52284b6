// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace cullet
{
/// A bar with percentage and time left on one line of stderr, when stderr is a terminal; silent otherwise.
class Progress
{
public:
    /// @param total steps until the end, > 0
    /// @param quiet no bar even on a terminal
    Progress(std::string label, std::uint64_t total, bool quiet);

    /// Wipes the line.
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// Reports that `done` of the steps are complete. Redraws at most ten times a second.
    void show(std::uint64_t done);

    /// Reports that one more step is complete.
    void advance() { show(++m_done); }

private:
    using Clock = std::chrono::steady_clock;

    std::string m_label;
    std::uint64_t m_total;
    std::uint64_t m_done = 0;  ///< counted by advance()
    bool m_enabled;
    Clock::time_point m_start;
    Clock::time_point m_drawn;
};

/// "1:05" or "2:03:00"; "--:--" for an unknown time (negative).
std::string formatDuration(double seconds);
}  // namespace cullet
