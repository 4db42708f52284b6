// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/cuda/runtime/device_status.h"

namespace cullet
{
namespace
{
std::string nameOf(int device)
{
    return "CUDA device " + std::to_string(device);
}

std::string capabilityText(int architecture)
{
    return std::to_string(architecture / 10) + "." + std::to_string(architecture % 10);
}

std::string versionText(int version)
{
    return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}
}  // namespace

std::string whyNoDevice(cudaError_t error, int driver, int runtime)
{
    if (error == cudaErrorNoDevice)
        return "no CUDA device is visible (none in the machine, or CUDA_VISIBLE_DEVICES hides it)";
    if (error != cudaErrorInsufficientDriver)
        return std::string("the CUDA runtime does not start: ") + cudaGetErrorString(error);
    // The runtime reports a missing driver as a driver that is too old, of version 0.
    if (driver == 0)
        return "no NVIDIA driver is installed";
    return "the NVIDIA driver supports CUDA " + versionText(driver) + ", this build needs CUDA " +
           versionText(runtime);
}

std::string whyRefused(int device, const DeviceTraits& traits, int oldest)
{
    if (traits.computeMode == cudaComputeModeProhibited)
        return nameOf(device) + " is in compute mode Prohibited";
    if (traits.architecture < oldest)
        return nameOf(device) + " has compute capability " + capabilityText(traits.architecture) +
               "; this build has code for " + capabilityText(oldest) + " and newer";
    return {};
}

std::string whyNotStarted(int device, int computeMode, const std::string& failed)
{
    const std::string words = nameOf(device) + " does not start: " + failed;
    const bool isExclusive =
        computeMode == cudaComputeModeExclusive || computeMode == cudaComputeModeExclusiveProcess;
    return isExclusive ? words + " (its compute mode lets one process at a time use it)" : words;
}
}  // namespace cullet
