// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/solver/solver_rows.h"

class btCollisionObject;
class btManifoldPoint;
class btPersistentManifold;
struct btContactSolverInfo;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The points of a manifold that count: those within its threshold.
struct LivePoints
{
    LivePoints() = default;
    /// @param mask a bit for each point that counts
    LivePoints(btPersistentManifold& manifold, unsigned mask);

    btManifoldPoint* points[4];
    int count = 0;
};

/// The bits of a manifold's points that count.
unsigned livePointsOf(const btPersistentManifold& manifold);

/// Whether sliding friction of an object depends on its direction.
bool isAnisotropic(const btCollisionObject& object);

/// The k-th points of a block's manifolds, as the narrow phase and the application left them.
struct PointSource
{
    btManifoldPoint* points[kBlock];  ///< null where the lane has no such point
    /// Whether the directions of sliding friction are those that the kernel finds, which it stores in the points then.
    bool isPlain;
    BlockOfVectors positionA, positionB, normal;
    BlockOf isLive;  ///< 1, or 0 where the lane has no such point
    BlockOf gap;     ///< with the slop
    BlockOf friction, restitution, impulse;
    BlockOf errorReduction;
    BlockOf softness;         ///< 1 / mass
    BlockOfVectors slide[2];  ///< directions of sliding friction, which the kernel finds
    BlockOf isSliding;        ///< 1: the first of them is that of the velocity

    BlockOfVectors slideImpulse;  ///< of the last step, in a soft one

    bool hasDirections;        ///< some lanes of the following are not zero
    BlockOf slideVelocity[2];  ///< of a conveyor belt
    BlockOf slideSoftness;
    BlockOf anchor;  ///< 1: friction keeps the points in place

    bool turns;                 ///< some lanes have turning friction
    BlockOf spinning, rolling;  ///< coefficients
    BlockOfVectors roll[2];     ///< axes

    /// @name For finishSlides()
    ///@{
    const btCollisionObject* objects[2][kBlock];
    bool keeps[kBlock];  ///< the directions that the point has
    ///@}
};

/// The manifolds of a block, for the functions below.
struct BlockPoints
{
    btPersistentManifold* manifolds[kBlock];
    LivePoints live[kBlock];
    int lanes;
    bool isPlain;  ///< no point has flags that count, and no object anisotropic friction

    /// The k-th points of all lanes; null where there is none.
    void choose(int k, PointSource& source) const;
};

/// Reads what RowKernels::readPoints() leaves out, since few points have it.
///
/// @param turns whether some point of the block has turning friction
void readRarities(const btContactSolverInfo& info, const BlockPoints& points, bool turns,
                  PointSource& source);

/// Lets the application's directions and anisotropy change those of sliding friction, and stores them in the points.
void finishSlides(const SolverStep& step, PointSource& source);
}  // namespace CULLET_PRECISION
}  // namespace cullet
