// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <LinearMath/btVector3.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// What Broadphase::debugDraw() draws, and in which colours (red, green, blue from 0 to 1).
struct DebugDrawOptions
{
    bool boxes = true;  ///< the box of every body; boxes of bodies with pairs have pairedBoxColor
    /// The cells of the backend, see CellSource; columns extend from end to end of the world.
    bool cells = false;
    bool pairs = true;  ///< a line for each pair in the pair cache
    btVector3 boxColor = btVector3(btScalar(0.35), btScalar(0.55), btScalar(0.9));
    btVector3 pairedBoxColor = btVector3(btScalar(0.95), btScalar(0.6), btScalar(0.2));
    btVector3 cellColor = btVector3(btScalar(0.45), btScalar(0.45), btScalar(0.45));
    btVector3 pairColor = btVector3(btScalar(0.9), btScalar(0.2), btScalar(0.3));
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
