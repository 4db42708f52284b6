// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Replaces triangle_trees.cu in a build without CUDA.

#include "cullet/cuda/mid/triangle_trees.h"

#include <memory>
#include <string>

namespace cullet
{
std::unique_ptr<DeviceTriangleTrees> makeDeviceTriangleTrees(std::uint32_t, int, CUstream_st*,
                                                             std::string* why)
{
    if (why != nullptr)
        *why = "built without CUDA";
    return nullptr;
}
}  // namespace cullet
