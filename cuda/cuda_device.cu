// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

#include "cuda/cuda_device.h"

#include <cuda_runtime_api.h>

#include <string>

namespace cullet
{
namespace
{

// Compute capability times ten of the oldest device this build has code for; the build system says.
constexpr int kOldestArchitecture = CULLET_CUDA_OLDEST_ARCHITECTURE;

std::string capabilityText(int architecture)
{
    return std::to_string(architecture / 10) + "." + std::to_string(architecture % 10);
}

std::string versionText(int version)
{
    // CUDA packs 11.8 as 11080.
    return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

std::string reasonFor(cudaError_t error)
{
    if (error == cudaErrorInsufficientDriver)
    {
        int driver = 0;
        int runtime = 0;
        cudaDriverGetVersion(&driver);
        cudaRuntimeGetVersion(&runtime);
        // The runtime reports a missing driver as a driver that is too old, of version 0.
        if (driver == 0)
            return "no NVIDIA driver is installed";
        return "the NVIDIA driver supports CUDA " + versionText(driver) + ", this build needs CUDA " +
               versionText(runtime);
    }
    if (error == cudaErrorNoDevice)
        return "no CUDA device is visible (none in the machine, or CUDA_VISIBLE_DEVICES hides it)";
    return std::string("the CUDA runtime does not start: ") + cudaGetErrorString(error);
}

bool isUsable(std::string* reason)
{
    int deviceCount = 0;
    const cudaError_t error = cudaGetDeviceCount(&deviceCount);
    if (error != cudaSuccess)
    {
        *reason = reasonFor(error);
        return false;
    }
    if (deviceCount == 0)
    {
        *reason = reasonFor(cudaErrorNoDevice);
        return false;
    }
    for (int device = 0; device < deviceCount; ++device)
    {
        int major = 0;
        int minor = 0;
        int mode = cudaComputeModeDefault;
        if (cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device) != cudaSuccess ||
            cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, device) != cudaSuccess ||
            cudaDeviceGetAttribute(&mode, cudaDevAttrComputeMode, device) != cudaSuccess)
        {
            *reason = "CUDA device " + std::to_string(device) + " does not answer";
            continue;
        }
        const int architecture = 10 * major + minor;
        if (mode == cudaComputeModeProhibited)
            *reason = "CUDA device " + std::to_string(device) + " is in compute mode Prohibited";
        else if (architecture < kOldestArchitecture)
            *reason = "CUDA device " + std::to_string(device) + " has compute capability " +
                      capabilityText(architecture) + "; this build has code for " +
                      capabilityText(kOldestArchitecture) + " and newer";
        else
            return true;
    }
    return false;
}

}  // namespace

bool cudaDeviceUsable(std::string* why) noexcept
{
    bool isFound = false;
    try
    {
        std::string reason;
        isFound = isUsable(&reason);
        if (!isFound && why != nullptr)
            *why = reason;
    }
    catch (...)
    {
        // Only a string can fail to allocate here; the answer "no" stands without its reason.
    }
    // The runtime remembers the last error per thread; a later, unrelated check must not find this one.
    cudaGetLastError();
    return isFound;
}

}  // namespace cullet
