// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/progress.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <unistd.h>

namespace cullet
{
std::string formatDuration(double seconds)
{
    if (seconds < 0.0)
        return "--:--";
    const long whole = std::lround(seconds);
    char text[32];
    if (whole >= 3600)
        std::snprintf(text, sizeof(text), "%ld:%02ld:%02ld", whole / 3600, whole / 60 % 60, whole % 60);
    else
        std::snprintf(text, sizeof(text), "%ld:%02ld", whole / 60, whole % 60);
    return text;
}

Progress::Progress(std::string label, std::uint64_t total, bool quiet)
    : m_label(std::move(label)),
      m_total(std::max<std::uint64_t>(total, 1)),
      m_enabled(!quiet && isatty(STDERR_FILENO) == 1),
      m_start(Clock::now()),
      m_drawn(m_start)
{
}

Progress::~Progress()
{
    if (m_enabled)
        std::fputs("\r\033[K", stderr);
}

void Progress::show(std::uint64_t done)
{
    constexpr int kWidth = 30;
    const Clock::time_point now = Clock::now();
    if (!m_enabled || now - m_drawn < std::chrono::milliseconds(100))
        return;
    m_drawn = now;
    const double fraction = static_cast<double>(std::min(done, m_total)) / static_cast<double>(m_total);
    const double elapsed = std::chrono::duration<double>(now - m_start).count();
    const double left = done == 0 ? -1.0 : elapsed / fraction - elapsed;
    const int full = static_cast<int>(fraction * kWidth);
    const std::string bar = std::string(full, '#') + std::string(kWidth - full, '.');
    std::fprintf(stderr, "\r%s [%s] %3d %%, %s left\033[K", m_label.c_str(), bar.c_str(),
                 static_cast<int>(fraction * 100.0), formatDuration(left).c_str());
    std::fflush(stderr);
}
}  // namespace cullet
