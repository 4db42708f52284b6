// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/abi/status.h"
#include "cullet/broad/backend.h"

namespace cullet::abi
{
/// Requires the work of a device to have succeeded.
inline void requireDevice(Status status)
{
    require(status != Status::OutOfMemory, CULLET_ERROR_MEMORY, "out of memory on the device");
    require(status == Status::Ok, CULLET_ERROR_DEVICE, "the device failed");
}
}  // namespace cullet::abi
