// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Takes the place of the CUDA sources in a build without CUDA.

#include "broad/backend.h"

#include <memory>
#include <string>

namespace cullet
{
std::unique_ptr<Backend> makeCudaPsapBackend(const PsapOptions&, std::string* why)
{
    if (why != nullptr)
        *why = "built without CUDA";
    return nullptr;
}
}  // namespace cullet
