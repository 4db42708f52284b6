// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/device_finders.h"
#include "cullet/comparison/thesis/thesis_backend.h"
#include "cullet/cuda/kernels/cuda_exec.cuh"
#include "cullet/cuda/pair_finder.cuh"
#include "cullet/cuda/runtime/cuda_device.h"

#include <memory>
#include <string>

namespace cullet
{
std::unique_ptr<Backend> makeCudaThesisBackend(const ThesisOptions& options, std::string* why)
{
    using Made = psap::ThesisBackend<psap::CudaExec>;
    return makeOnDevice(options.device, why,
                        [&]() -> std::unique_ptr<Backend>
                        { return std::make_unique<Made>(options, "cuda"); });
}

std::unique_ptr<DevicePairFinder> makeThesisPairFinder(const ThesisOptions& options, CUstream_st* stream,
                                                       std::string* why)
{
    using Made = psap::PairFinder<psap::CellSearch, ThesisOptions>;
    return makeOnDevice(options.device, why,
                        [&]() -> std::unique_ptr<DevicePairFinder>
                        { return std::make_unique<Made>(options, stream); });
}
}  // namespace cullet
