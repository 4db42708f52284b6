// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/solver/solver_rows.h"

#include <LinearMath/btVector3.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
// Not for the kernels, whose instruction sets a function with external linkage must not have.

inline void setLane(BlockOfVectors& block, int lane, const btVector3& v)
{
    block.x.lane[lane] = v.x();
    block.y.lane[lane] = v.y();
    block.z.lane[lane] = v.z();
}

inline btVector3 laneOf(const BlockOfVectors& block, int lane)
{
    return {block.x.lane[lane], block.y.lane[lane], block.z.lane[lane]};
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
