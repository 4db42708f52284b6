// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <vector>

namespace cullet::test
{
/// Bytes that operator new and Bullet's allocator have given and not got back; exact while no other thread runs.
std::int64_t liveBytes() noexcept;

/// Resident bytes of this process, and the most there ever were; 0 where the system does not say.
struct Residence
{
    double now = 0, most = 0;
};

inline Residence residence()
{
    Residence bytes;
    std::FILE* const status = std::fopen("/proc/self/status", "r");
    if (status == nullptr)
        return bytes;
    char line[256];
    while (std::fgets(line, sizeof line, status) != nullptr)
    {
        double kilobytes = 0;
        if (std::sscanf(line, "VmRSS: %lf", &kilobytes) == 1)
            bytes.now = kilobytes * 1024;
        else if (std::sscanf(line, "VmHWM: %lf", &kilobytes) == 1)
            bytes.most = kilobytes * 1024;
    }
    std::fclose(status);
    return bytes;
}

/// The straight line nearest to samples, by least squares.
class Line
{
public:
    void add(double x, double y)
    {
        m_x.push_back(x);
        m_y.push_back(y);
    }
    std::size_t count() const { return m_x.size(); }

    /// Growth of y over the x of the samples, without the first part of them.
    ///
    /// @param warmUp part of the samples that is left out, from 0 to 1
    double growth(double warmUp) const
    {
        const std::size_t first = static_cast<std::size_t>(warmUp * static_cast<double>(count()));
        if (count() - first < 3)
            return 0;
        return slope(first) * (m_x.back() - m_x[first]);
    }

    /// Of the samples from the first one given on.
    double slope(std::size_t first) const
    {
        const double n = static_cast<double>(count() - first);
        double x = 0, y = 0, xx = 0, xy = 0;
        for (std::size_t i = first; i < count(); ++i)
        {
            x += m_x[i] / n;
            y += m_y[i] / n;
        }
        for (std::size_t i = first; i < count(); ++i)
        {
            xx += (m_x[i] - x) * (m_x[i] - x);
            xy += (m_x[i] - x) * (m_y[i] - y);
        }
        return xx > 0 ? xy / xx : 0;
    }

private:
    std::vector<double> m_x, m_y;
};
}  // namespace cullet::test
