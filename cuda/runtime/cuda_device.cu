// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

#include "cullet/cuda/runtime/cuda_device.h"
#include "cullet/cuda/runtime/cuda_error.h"
#include "cullet/cuda/runtime/device_status.h"

#include <cuda_runtime_api.h>

#include <string>

namespace cullet
{
namespace
{

// Compute capability times ten of the oldest device that this build has code for; set by the build system.
constexpr int kOldestArchitecture = CULLET_CUDA_OLDEST_ARCHITECTURE;

/// Number of devices visible to this process; for 0 also the reason.
int deviceCount(std::string* reason)
{
    int count = 0;
    cudaError_t error = CULLET_CUDA_RESULT(cudaGetDeviceCount(&count));
    if (error == cudaSuccess && count == 0)
        error = cudaErrorNoDevice;
    if (error == cudaSuccess)
        return count;
    int driver = 0;
    int runtime = 0;
    cudaDriverGetVersion(&driver);
    cudaRuntimeGetVersion(&runtime);
    *reason = whyNoDevice(error, driver, runtime);
    return 0;
}

bool isUsable(int device, std::string* reason)
{
    int major = 0;
    int minor = 0;
    int mode = cudaComputeModeDefault;
    const auto read = [device](int* value, cudaDeviceAttr attribute)
    { return CULLET_CUDA_RESULT(cudaDeviceGetAttribute(value, attribute, device)) == cudaSuccess; };
    if (read(&major, cudaDevAttrComputeCapabilityMajor) && read(&minor, cudaDevAttrComputeCapabilityMinor) &&
        read(&mode, cudaDevAttrComputeMode))
        *reason = whyRefused(device, {10 * major + minor, mode}, kOldestArchitecture);
    else
        *reason = "CUDA device " + std::to_string(device) + " does not answer";
    return reason->empty();
}

bool isAnyUsable(std::string* reason)
{
    const int count = deviceCount(reason);
    for (int device = 0; device < count; ++device)
    {
        if (isUsable(device, reason))
            return true;
    }
    return false;
}

bool isChosenUsable(int device, std::string* reason)
{
    const int count = deviceCount(reason);
    if (count == 0)
        return false;
    if (device >= 0 && device < count)
        return isUsable(device, reason);
    *reason = "there is no CUDA device " + std::to_string(device) + "; devices 0 to " +
              std::to_string(count - 1) + " are visible";
    return false;
}

/// Returns the result of `probe`, and the reason where it is false. Leaves no CUDA error behind.
template <class Probe>
bool answer(std::string* why, const Probe& probe) noexcept
{
    bool isFound = false;
    try
    {
        std::string reason;
        isFound = probe(&reason);
        if (!isFound && why != nullptr)
            *why = reason;
    }
    catch (...)
    {
        // Only a string can fail to allocate here. This one is short enough to need no memory.
        if (why != nullptr)
            *why = "out of memory";
    }
    // The runtime remembers the last error per thread; a later, unrelated check must not find this one.
    cudaGetLastError();
    return isFound;
}

}  // namespace

bool cudaDeviceUsable(std::string* why) noexcept
{
    return answer(why, [](std::string* reason) { return isAnyUsable(reason); });
}

bool cudaDeviceUsable(int device, std::string* why) noexcept
{
    return answer(why, [device](std::string* reason) { return isChosenUsable(device, reason); });
}

std::string whyNotStarted(int device, const psap::ExecutorFailure& failure)
{
    int mode = cudaComputeModeDefault;
    cudaDeviceGetAttribute(&mode, cudaDevAttrComputeMode, device);
    cudaGetLastError();
    return whyNotStarted(device, mode, std::string(failure.call) + ": " + failure.reason);
}

}  // namespace cullet
