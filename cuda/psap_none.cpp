// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

#include "broad/backend.h"

#ifdef CULLET_HAS_CUDA
#include "cuda/cuda_device.h"
#endif

#include <memory>
#include <string>

namespace cullet
{

std::unique_ptr<Backend> makeCudaPsapBackend(const PsapOptions&, std::string* why)
{
    if (why == nullptr)
        return nullptr;
#ifdef CULLET_HAS_CUDA
    if (cudaDeviceUsable(why))
        *why = "this build has CUDA but not yet the CUDA backend";
#else
    *why = "built without CUDA";
#endif
    return nullptr;
}

}  // namespace cullet
