// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cuda_runtime_api.h>

#include <string>

namespace cullet
{
/// Why there is no CUDA device at all, in words.
///
/// @param error   of the first call
/// @param driver  newest CUDA version that the driver supports, as CUDA packs versions: 11.8 is 11080; 0: there is no
///     driver
/// @param runtime CUDA version of this build
std::string whyNoDevice(cudaError_t error, int driver, int runtime);

/// Properties of a device, as the runtime reports them.
struct DeviceTraits
{
    int architecture;  ///< compute capability times ten
    int computeMode;
};

/// Why a build cannot use that device, in words; empty: it can.
///
/// @param oldest architecture that the build has code for
std::string whyRefused(int device, const DeviceTraits& traits, int oldest);

/// Why a device that was not refused does not start.
///
/// @param failed call and reason, in words
std::string whyNotStarted(int device, int computeMode, const std::string& failed);
}  // namespace cullet
