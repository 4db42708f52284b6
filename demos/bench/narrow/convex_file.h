// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/narrow/convex_motion.h"

#include <cstdint>
#include <string>

namespace cullet
{
/// The first bytes of a file of pairs. Then follow, packed and little-endian:
/// - uint32 [hulls + 1]: where each hull's points begin, and their number,
/// - float [points][3],
/// - BodyPose [2 pairs]: bodies 2 k and 2 k + 1 are pair k,
/// - float [pairs]: how deep the pair overlaps, proved to 1e-4 of the size; 0: it is apart.
struct ConvexFileHead
{
    char mark[4] = {'C', 'X', 'P', 'R'};
    std::uint32_t version = 1;
    std::uint32_t hulls = 0, points = 0, pairs = 0;
};

/// What a file has.
struct ConvexFileSums
{
    std::uint32_t overlapping = 0;
    double pointsPerContact = 0;  ///< of cullet's contacts of these, with the margin of cullet_convex_times
};

/// Writes the pairs of a frame with cullet's depths, which are computed on the CPU, with the same bits as on a device.
///
/// @pre the motion is without isFirstAtRest
/// @throws std::runtime_error if the file cannot be written, or if more or fewer pairs overlap than are planted, or a
///     depth is not proved
ConvexFileSums writeConvexFile(const ConvexMotion& motion, int frame, const std::string& path);
}  // namespace cullet
