// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <BulletDynamics/Dynamics/btDynamicsWorld.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// How well a world rests, at the end of a step.
struct WorldQuality
{
    /// Depth of contact points that overlap, margins included: mean, 99th percentile and maximum, metres.
    double meanDepth = 0, p99Depth = 0, maxDepth = 0;
    double energy = 0;           ///< kinetic, of the mean rigid body that can move, joules
    std::uint64_t sleepers = 0;  ///< rigid bodies that can move and are asleep
};

/// Costs a pass over all contact points and bodies.
WorldQuality qualityOf(btDynamicsWorld& world);
}  // namespace CULLET_PRECISION
}  // namespace cullet
