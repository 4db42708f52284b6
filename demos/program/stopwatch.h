// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <chrono>
#include <ctime>

namespace cullet
{
/// Wall time and CPU time of the whole process since construction, in milliseconds.
///
/// On a shared machine the CPU time of a single thread is the steadier of the two; with several threads the wall time
/// is what a user waits for.
class Stopwatch
{
public:
    Stopwatch() : m_cpuStart(cpuNow()), m_start(std::chrono::steady_clock::now()) {}

    double wallMs() const
    {
        return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - m_start).count();
    }

    double cpuMs() const { return cpuNow() - m_cpuStart; }

private:
    static double cpuNow()
    {
        timespec time = {};
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
        return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
    }

    double m_cpuStart;
    // Read last: to read the CPU time is a call of the system, a microsecond or more, which the wall time must not have.
    std::chrono::steady_clock::time_point m_start;
};
}  // namespace cullet
