// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Replaces contact_finder.cu in a build without CUDA.

#include "cullet/cuda/contacts/contact_finder.h"

#include <memory>
#include <string>

namespace cullet
{
std::unique_ptr<DeviceContactFinder> makeDeviceContactFinder(const HullSet&, const PsapOptions&, CUstream_st*,
                                                             std::string* why)
{
    if (why != nullptr)
        *why = "built without CUDA";
    return nullptr;
}
}  // namespace cullet
