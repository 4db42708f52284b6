// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/program/files/result_file.h"

#include <cstdint>

namespace cullet
{
/// Options of `cullet bench narrow --device`.
struct DeviceNarrowOptions
{
    std::uint32_t mostPairs = 10000000;  ///< cases with more are left out
    int repetitions = 30;  ///< frames of each case, warm and cold; at most 10 of more than a million pairs
    unsigned seed = 12345;
};

/// Times queries of convex pairs in device memory (ConvexMotion, timeConvexPairs()).
///
/// Columns: pairs, vertices, mix (separated/near/overlapping of a hundred), degrees a frame, query (booleans; depths or
/// contacts: with the booleans and the list of overlaps; ids: poses come from the CPU's memory and the list of overlaps
/// goes there, and the first body of each pair rests, timeRoundTrips()), warm_ms, warm_p90_ms and cold_ms (the device's
/// clock, or of ids the CPU's; L2 flushed before each frame), pairs_per_us, cpu_ms (only of ids: the same warm booleans on
/// one thread, timeOnOneThread()), bytes of device memory, and of the last warm frame failed, remembered,
/// doubtful and overlapping pairs, and depths that took a large polytope or all faces. Each frame finds as many
/// overlapping pairs as were planted, all depths proved to 1e-4 of the size, and no contact empty.
///
/// The file is saved after each case. One that throws, for a wrong answer or a failing device, prints its message, and
/// the others go on.
///
/// @throws ProgramError: kExitUnavailable without a device, or in a build without CUDA; kExitDisagreement at last, with the
///     messages, if a case threw; kExitOutput
void runDeviceNarrowBench(const DeviceNarrowOptions& options, ResultFile& file);
}  // namespace cullet
