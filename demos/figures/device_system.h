// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/row_pair.h"
#include "cullet/cuda/narrow/hull_set.h"
#include "cullet/cuda/narrow/pair_types.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace cullet
{
/// Broad and narrow phase of hulls on a GPU, from poses of the CPU to the places of overlapping pairs there.
class DeviceSystem
{
public:
    virtual ~DeviceSystem() = default;

    /// @param poses in pinned memory once they are copied there, which is not timed
    /// @return wall milliseconds: upload, search, download
    virtual double step(const std::vector<BodyPose>& poses) = 0;
    /// Of the last step.
    virtual std::uint64_t pairCount() const = 0;
    virtual std::vector<RowPair> overlaps() const = 0;
};

/// @return null without a device
std::unique_ptr<DeviceSystem> makeDeviceSystem(const HullSet& hulls);
}  // namespace cullet
