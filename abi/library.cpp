// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/abi/status.h"
#include "cullet/broad/log.h"

#include <LinearMath/btScalar.h>

#include <atomic>
#include <cstdio>

namespace cullet::abi
{
namespace
{
thread_local char lastError[256] = "";

std::atomic<cullet_log_function> logFunction{nullptr};

void forwardMessage(LogLevel level, const char* message)
{
    if (const cullet_log_function function = logFunction.load(std::memory_order_acquire))
        function(static_cast<std::int32_t>(level), message);
}
}  // namespace

cullet_status fail(cullet_status status, const char* text) noexcept
{
    std::snprintf(lastError, sizeof(lastError), "%s", text);
    return status;
}
}  // namespace cullet::abi

using namespace cullet;
using namespace cullet::abi;

uint32_t cullet_abi_version(void)
{
    return CULLET_ABI_VERSION;
}

const char* cullet_version(void)
{
    return CULLET_VERSION;
}

int32_t cullet_precision(void)
{
    return static_cast<int32_t>(8 * sizeof(btScalar));
}

const char* cullet_status_name(cullet_status status)
{
    switch (status)
    {
        case CULLET_OK:
            return "CULLET_OK";
        case CULLET_EMPTY_BOXES:
            return "CULLET_EMPTY_BOXES";
        case CULLET_SOME_NOT_CONVERGED:
            return "CULLET_SOME_NOT_CONVERGED";
        case CULLET_ERROR_NULL:
            return "CULLET_ERROR_NULL";
        case CULLET_ERROR_ARGUMENT:
            return "CULLET_ERROR_ARGUMENT";
        case CULLET_ERROR_SIZE:
            return "CULLET_ERROR_SIZE";
        case CULLET_ERROR_ID:
            return "CULLET_ERROR_ID";
        case CULLET_ERROR_NOT_FINITE:
            return "CULLET_ERROR_NOT_FINITE";
        case CULLET_ERROR_PRECISION:
            return "CULLET_ERROR_PRECISION";
        case CULLET_ERROR_NO_DEVICE:
            return "CULLET_ERROR_NO_DEVICE";
        case CULLET_ERROR_DEVICE:
            return "CULLET_ERROR_DEVICE";
        case CULLET_ERROR_MEMORY:
            return "CULLET_ERROR_MEMORY";
        case CULLET_ERROR_NOT_CONVERGED:
            return "CULLET_ERROR_NOT_CONVERGED";
        case CULLET_ERROR_INTERNAL:
            return "CULLET_ERROR_INTERNAL";
        default:
            return "unknown";
    }
}

const char* cullet_last_error(void)
{
    return lastError;
}

void cullet_set_log_function(cullet_log_function function)
{
    logFunction.store(function, std::memory_order_release);
    setLogFunction(function == nullptr ? nullptr : forwardMessage);
}
