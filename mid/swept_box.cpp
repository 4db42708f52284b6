// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/mid/swept_box.h"

#include <cfloat>
#include <cmath>

namespace cullet
{
namespace
{
constexpr double kLargest = 1e18;
/// Slower than this along an axis, the box counts as parallel to it: it then has both of its places there.
constexpr double kSlowest = 1e-15;

bool prepareAxis(const SweptBox& box, int axis, SweptQuery& query) noexcept
{
    const double origin = box.origin[axis];
    double motion = box.motion[axis];
    // Written so that a NaN fails.
    if (!(std::abs(origin) <= kLargest && std::abs(motion) <= kLargest &&
          std::abs(box.min[axis]) <= kLargest && std::abs(box.max[axis]) <= kLargest))
        return false;
    double slack = FLT_MIN;
    if (std::abs(motion) < kSlowest)
    {
        slack += std::abs(motion);
        motion = std::copysign(kSlowest, motion);
    }
    const float low = roundUpToFloat(origin + box.max[axis] + slack);     // subtracted from minima
    const float high = roundDownToFloat(origin + box.min[axis] - slack);  // subtracted from maxima
    query.nearOrigin[axis] = motion < 0.0 ? high : low;
    query.farOrigin[axis] = motion < 0.0 ? low : high;
    query.inverse[axis] = static_cast<float>(1.0 / motion);
    return true;
}
}  // namespace

bool SweptBox::prepare(SweptQuery& query) const noexcept
{
    query.limit = sweptLimit(1.0);
    return prepareAxis(*this, 0, query) && prepareAxis(*this, 1, query) && prepareAxis(*this, 2, query);
}

float sweptLimit(double share) noexcept
{
    // The kernels' entry has three roundings.
    return roundUpToFloat(share + std::abs(share) * 4e-7);
}
}  // namespace cullet
