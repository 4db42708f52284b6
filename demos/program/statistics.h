// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <vector>

namespace cullet
{
/// Summary of a sample of times; all zero for an empty sample.
struct Statistics
{
    double median = 0.0;  ///< mean of the two middle values of an even sample
    double p90 = 0.0;     ///< smallest value that at least 90 % do not exceed
    double min = 0.0;
    double max = 0.0;
    double mean = 0.0;
};

Statistics summarise(std::vector<double> sample);
}  // namespace cullet
