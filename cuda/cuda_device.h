// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

#pragma once

#include <string>

namespace cullet
{

/// Says whether the CUDA runtime finds a device that this build has code for.
///
/// Makes no context and leaves no CUDA error behind; safe to call on a machine without a driver.
///
/// @param why  [out, may be null] the reason in words when the answer is no; otherwise unchanged
/// Errors: none
bool cudaDeviceUsable(std::string* why) noexcept;

}  // namespace cullet
