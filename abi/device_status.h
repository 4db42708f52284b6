// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/abi/status.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/row_pair.h"

#include <cstdint>
#include <string>

namespace cullet::abi
{
static_assert(sizeof(cullet_pair) == sizeof(RowPair), "pairs are handed out as they are");

inline void requireOrdinal(std::int32_t device)
{
    require(device >= 0, CULLET_ERROR_ARGUMENT, "device: an ordinal from 0 on expected");
}

/// Requires what works on a device to have been made.
///
/// @param why the reason if it has not
inline void requireMade(const void* made, const std::string& why)
{
    if (made == nullptr)
        throw Failure{CULLET_ERROR_NO_DEVICE, "no CUDA device: " + why};
}

/// Requires the work of a device to have succeeded.
inline void requireDevice(Status status)
{
    require(status != Status::OutOfMemory, CULLET_ERROR_MEMORY, "out of memory on the device");
    require(status == Status::Ok, CULLET_ERROR_DEVICE, "the device failed");
}
}  // namespace cullet::abi
