// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/psap/exec/executor_failure.h"
#include "cullet/cuda/kernels/cuda_exec.cuh"

#include <new>

namespace cullet::psap
{
/// Calls `body`. After a failure waits for all work and calls `forget`.
template <class Body, class Forget>
Status guarded(CudaExec& exec, const Body& body, const Forget& forget)
{
    Status status = Status::OutOfMemory;
    try
    {
        const CudaExec::DeviceGuard use(exec);
        body();
        return Status::Ok;
    }
    catch (const ExecutorFailure& failure)
    {
        status = failure.status;
    }
    catch (const std::bad_alloc&)
    {
    }
    exec.drain();
    forget();
    return status;
}
}  // namespace cullet::psap
