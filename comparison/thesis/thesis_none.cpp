// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Replaces thesis_cuda.cu in a build without CUDA.

#include "cullet/comparison/device_finders.h"

namespace cullet
{
std::unique_ptr<Backend> makeCudaThesisBackend(const ThesisOptions& options, std::string* why)
{
    return makeCudaPsapBackend(options, why);
}

std::unique_ptr<DevicePairFinder> makeThesisPairFinder(const ThesisOptions& options, CUstream_st* stream,
                                                       std::string* why)
{
    return makeDevicePairFinder(options, stream, why);
}
}  // namespace cullet
