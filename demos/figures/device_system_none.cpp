// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Replaces device_system.cpp in a build without CUDA.

#include "cullet/demos/figures/device_system.h"

namespace cullet
{
std::unique_ptr<DeviceSystem> makeDeviceSystem(const HullSet&)
{
    return nullptr;
}
}  // namespace cullet
