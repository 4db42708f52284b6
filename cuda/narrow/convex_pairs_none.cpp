// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Replaces convex_pairs.cu in a build without CUDA.

#include "cullet/cuda/narrow/convex_pairs.h"

#include <memory>
#include <string>

namespace cullet
{
std::unique_ptr<DeviceConvexPairs> makeDeviceConvexPairs(const HullSet&, int, CUstream_st*, std::string* why)
{
    if (why != nullptr)
        *why = "built without CUDA";
    return nullptr;
}
}  // namespace cullet
