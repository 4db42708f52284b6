// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Replaces the CUDA sources in a build without CUDA.

#include "cullet/broad/backend.h"
#include "cullet/cuda/device_pairs.h"

#include <cstddef>
#include <memory>
#include <string>

namespace cullet
{
namespace
{
std::nullptr_t refuse(std::string* why)
{
    if (why != nullptr)
        *why = "built without CUDA";
    return nullptr;
}
}  // namespace

std::unique_ptr<Backend> makeCudaPsapBackend(const PsapOptions&, std::string* why)
{
    return refuse(why);
}

std::unique_ptr<DevicePairFinder> makeDevicePairFinder(const PsapOptions&, CUstream_st*, std::string* why)
{
    return refuse(why);
}

std::unique_ptr<DeviceDeltaFinder> makeDeviceDeltaFinder(const PsapOptions&, CUstream_st*, std::string* why)
{
    return refuse(why);
}
}  // namespace cullet
