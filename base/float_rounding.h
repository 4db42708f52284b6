// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cmath>
#include <limits>

namespace cullet
{
/// Largest float that is not above `value`; -inf and +inf stay, a value beyond the float range becomes -inf or FLT_MAX.
inline float roundDownToFloat(double value) noexcept
{
    const float nearest = static_cast<float>(value);
    return static_cast<double>(nearest) > value
               ? std::nextafter(nearest, -std::numeric_limits<float>::infinity())
               : nearest;
}

/// Smallest float that is not below `value`.
inline float roundUpToFloat(double value) noexcept
{
    const float nearest = static_cast<float>(value);
    return static_cast<double>(nearest) < value
               ? std::nextafter(nearest, std::numeric_limits<float>::infinity())
               : nearest;
}
}  // namespace cullet
