// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/narrow/convex_motion.h"

namespace cullet
{
/// Median milliseconds of one thread's isaGjk() in float for all pairs of a frame, of a motion that goes to and fro; each pair
/// remembers its last query. Rotations are matrices before the clock starts.
///
/// @throws std::runtime_error if more or fewer pairs overlap than are planted
double timeOnOneThread(const ConvexMotion& motion, int frames);
}  // namespace cullet
