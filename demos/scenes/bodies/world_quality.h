// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <BulletDynamics/Dynamics/btDynamicsWorld.h>

#include <cstdint>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Mean, 99th percentile and maximum of depths above 0, metres; 0 if there are none.
struct DepthSummary
{
    double mean = 0, p99 = 0, max = 0;
};

/// How well a world rests, at the end of a step.
struct WorldQuality
{
    DepthSummary points;         ///< of contact points, margins included
    DepthSummary pairs;          ///< of pairs of objects, by their shapes (exactDepths())
    double energy = 0;           ///< kinetic, of the mean rigid body that can move, joules
    std::uint64_t sleepers = 0;  ///< rigid bodies that can move and are asleep
    /// Distance between the places of a pivot in the two bodies of a ball, hinge or cone joint: mean and maximum, metres.
    double meanJointError = 0, maxJointError = 0;
};

/// Costs a pass over all contact points, bodies and joints, and exactDepths().
WorldQuality qualityOf(btDynamicsWorld& world);

/// Rigid bodies that can move, and those of them that are asleep.
struct Sleepers
{
    std::uint64_t bodies = 0, sleepers = 0;

    bool areAlmostAll() const { return bodies > 0 && 100 * sleepers >= 99 * bodies; }
};
Sleepers sleepersOf(const btDynamicsWorld& world);

/// Centres of mass of the rigid bodies that can move, in the order of the world.
std::vector<btVector3> placesOf(const btDynamicsWorld& world);

/// Mean distance of places from others of the same bodies, metres; 0 without bodies.
double meanWay(const std::vector<btVector3>& from, const std::vector<btVector3>& to);
}  // namespace CULLET_PRECISION
}  // namespace cullet
