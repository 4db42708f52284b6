// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/cuda/runtime/fault_injection.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

namespace cullet::test
{
/// The status of an update or a search after such a failing call.
inline Status statusOf(FaultInjection fault)
{
    return fault == FaultInjection::OutOfMemory ? Status::OutOfMemory : Status::DeviceLost;
}

/// Ends the fault at the end of the scope.
struct FaultEnd
{
    FaultEnd() = default;
    FaultEnd(const FaultEnd&) = delete;
    FaultEnd& operator=(const FaultEnd&) = delete;
    ~FaultEnd() { setCudaFault(FaultInjection::None, 0); }
};

/// The call after begin() that fails.
struct FaultPlan
{
    FaultInjection fault;
    std::uint64_t call;

    void begin() const { setCudaFault(fault, call); }
};

/// Fails every CUDA call of `body` once, one in each run; returns the number of calls.
///
/// @param body receives the plan, begins it, and ends the fault when a failure is reported
template <class Body>
std::uint64_t failEachCall(FaultInjection fault, const Body& body)
{
    for (std::uint64_t call = 0;; ++call)
    {
        SCOPED_TRACE("call " + std::to_string(call));
        const FaultEnd end;
        body(FaultPlan{fault, call});
        // A call that need not succeed may fail unnoticed.
        if (!hasCudaFaultHappened() || testing::Test::HasFailure())
            return call;
    }
}
}  // namespace cullet::test
