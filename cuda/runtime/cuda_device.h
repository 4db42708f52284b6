// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

#pragma once

#include "cullet/broad/psap/exec/executor_failure.h"

#include <new>
#include <string>

namespace cullet
{

/// Whether the CUDA runtime finds a device that this build has code for.
///
/// Makes no context and leaves no CUDA error behind; safe to call on a machine without a driver.
///
/// @param why  [out, may be null] the reason in words when the result is false; otherwise unchanged
/// Errors: none
bool cudaDeviceUsable(std::string* why) noexcept;

/// Whether this build can use that device.
///
/// @param device ordinal; any number
bool cudaDeviceUsable(int device, std::string* why) noexcept;

/// Why a device that is usable has failed to start, in words.
std::string whyNotStarted(int device, const psap::ExecutorFailure& failure);

/// Returns the result of `make`, or null with the reason in words in `*why`, which may be null: the device cannot be
/// used, `make` has thrown ExecutorFailure, or memory is short.
template <class Make>
auto makeOnDevice(int device, std::string* why, const Make& make) -> decltype(make())
{
    std::string unread;
    std::string& reason = why != nullptr ? *why : unread;
    try
    {
        if (cudaDeviceUsable(device, &reason))
        {
            try
            {
                return make();
            }
            catch (const psap::ExecutorFailure& failure)
            {
                reason = whyNotStarted(device, failure);
            }
        }
    }
    catch (const std::bad_alloc&)
    {
        // Short enough for a string without memory of its own.
        reason = "out of memory";
    }
    return nullptr;
}

}  // namespace cullet
