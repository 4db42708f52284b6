// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace cullet
{
/// The value below which that share of the values lies. @pre there is one
inline double quantile(std::vector<double> values, double share)
{
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}
}  // namespace cullet
