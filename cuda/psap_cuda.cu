// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/psap_backend.h"
#include "cuda/cuda_device.h"
#include "cuda/cuda_exec.cuh"

#include <memory>
#include <string>

namespace cullet
{
std::unique_ptr<Backend> makeCudaPsapBackend(const PsapOptions& options, std::string* why)
{
    std::string reason;
    if (cudaDeviceUsable(&reason))
    {
        try
        {
            return std::make_unique<psap::PsapBackend<psap::CudaExec>>(options, "cuda", options);
        }
        catch (const psap::ExecutorFailure& failure)
        {
            reason = "CUDA device " + std::to_string(options.device) + " does not start: " + failure.call +
                     ": " + failure.reason;
        }
    }
    if (why != nullptr)
        *why = reason;
    return nullptr;
}
}  // namespace cullet
