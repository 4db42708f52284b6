// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/psap/psap_backend.h"
#include "cullet/cuda/kernels/cuda_exec.cuh"
#include "cullet/cuda/runtime/cuda_device.h"

#include <memory>
#include <string>

namespace cullet
{
std::unique_ptr<Backend> makeCudaPsapBackend(const PsapOptions& options, std::string* why)
{
    return makeOnDevice(
        options.device, why,
        [&]() -> std::unique_ptr<Backend>
        { return std::make_unique<psap::PsapBackend<psap::CudaExec>>(options, "cuda", options); });
}
}  // namespace cullet
