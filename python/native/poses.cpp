// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/python/native/poses.h"

#include <cmath>

namespace cullet::python
{
namespace
{
[[noreturn]] void refuse(const char* name, const char* what)
{
    throw nb::value_error((std::string(name) + ": " + what).c_str());
}

/// @param p x, y, z, and a quaternion of any length but 0: x, y, z, w
cullet_pose poseOfQuaternion(const double (&p)[7], const char* name)
{
    const double x = p[3], y = p[4], z = p[5], w = p[6];
    const double norm = x * x + y * y + z * z + w * w;
    // A NaN fails too.
    if (!(norm > 0.0 && std::isfinite(norm)))
        refuse(name, "a quaternion is zero or not finite");
    const double s = 2.0 / norm;
    return {{1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w), s * (x * y + z * w),
             1.0 - s * (x * x + z * z), s * (y * z - x * w), s * (x * z - y * w), s * (y * z + x * w),
             1.0 - s * (x * x + y * y)},
            {p[0], p[1], p[2]}};
}

cullet_pose poseOfMatrix(const double (&m)[16], const char* name)
{
    if (!(m[12] == 0.0 && m[13] == 0.0 && m[14] == 0.0 && m[15] == 1.0))
        refuse(name, "the last row of a matrix is not 0, 0, 0, 1");
    return {{m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]}, {m[3], m[7], m[11]}};
}
}  // namespace

std::vector<cullet_pose> readPoses(const AnyArray& array, const char* name)
{
    const NumberArray numbers(array, name);
    const std::size_t ndim = numbers.ndim();
    const bool isMatrix = ndim >= 2 && numbers.shape(ndim - 1) == 4 && numbers.shape(ndim - 2) == 4;
    const bool isQuaternion = !isMatrix && ndim >= 1 && numbers.shape(ndim - 1) == 7;
    const std::size_t inner = isMatrix ? 2 : 1;
    if ((!isMatrix && !isQuaternion) || ndim > inner + 1)
        refuse(name, "shape (n,7), (7,), (n,4,4) or (4,4) expected");
    const bool isList = ndim == inner + 1;
    const std::size_t count = isList ? numbers.shape(0) : 1;
    std::vector<cullet_pose> poses;
    poses.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
    {
        const std::ptrdiff_t first = isList ? static_cast<std::ptrdiff_t>(i) * numbers.stride(0) : 0;
        double row[16];
        for (std::ptrdiff_t k = 0; k < (isMatrix ? 16 : 7); ++k)
            row[k] = numbers.at(
                first + (isMatrix ? k / 4 * numbers.stride(ndim - 2) + k % 4 * numbers.stride(ndim - 1)
                                  : k * numbers.stride(ndim - 1)));
        if (isMatrix)
            poses.push_back(poseOfMatrix(row, name));
        else
            poses.push_back(poseOfQuaternion({row[0], row[1], row[2], row[3], row[4], row[5], row[6]}, name));
    }
    return poses;
}
}  // namespace cullet::python
