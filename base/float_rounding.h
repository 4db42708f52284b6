// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <cstring>

namespace cullet
{
/// The float before or after one that is not infinite in that direction, as std::nextafter() without a call and without
/// floating-point exceptions.
///
/// @param isUp   whether the result is the next larger float
/// @param isStep false: returns the value. Not a branch, since callers cannot predict it
inline float stepFloat(float value, bool isUp, bool isStep) noexcept
{
    std::int32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    constexpr std::int32_t kSign = INT32_MIN;
    if ((bits & ~kSign) == 0 && isStep)
        bits = isUp ? 0 : kSign;  // the zero that is next to the smallest numbers of that side
    // Larger bits are farther from zero.
    bits += (bits < 0) != isUp ? std::int32_t{isStep} : -std::int32_t{isStep};
    std::memcpy(&value, &bits, sizeof bits);
    return value;
}

/// Largest float that is not above `value`; -inf and +inf stay, a value beyond the float range becomes -inf or FLT_MAX.
inline float roundDownToFloat(double value) noexcept
{
    const float nearest = static_cast<float>(value);
    return stepFloat(nearest, false, static_cast<double>(nearest) > value);
}

/// Smallest float that is not below `value`.
inline float roundUpToFloat(double value) noexcept
{
    const float nearest = static_cast<float>(value);
    return stepFloat(nearest, true, static_cast<double>(nearest) < value);
}
}  // namespace cullet
