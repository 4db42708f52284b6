// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/statistics.h"

#include <algorithm>
#include <numeric>

namespace cullet
{
Statistics summarise(std::vector<double> sample)
{
    if (sample.empty())
        return {};
    std::sort(sample.begin(), sample.end());
    const std::size_t count = sample.size();
    Statistics statistics;
    statistics.median = 0.5 * (sample[(count - 1) / 2] + sample[count / 2]);
    statistics.p90 = sample[(9 * count + 9) / 10 - 1];
    statistics.min = sample.front();
    statistics.max = sample.back();
    statistics.mean = std::accumulate(sample.begin(), sample.end(), 0.0) / static_cast<double>(count);
    return statistics;
}
}  // namespace cullet
