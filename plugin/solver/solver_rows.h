// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <LinearMath/btScalar.h>

#include <cstddef>
#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Manifolds or joints in a block: kernels solve them at once, in as many registers as that takes.
constexpr int kBlock = 8;

/// One number for each lane of a block.
struct alignas(kBlock * sizeof(btScalar)) BlockOf
{
    btScalar lane[kBlock];
};

/// A vector for each lane of a block.
struct BlockOfVectors
{
    BlockOf x, y, z;
};

/// A linear and an angular vector of a body, in the world: its velocity, say. The fourth numbers are zero.
struct alignas(8 * sizeof(btScalar)) SolverMotion
{
    btScalar linear[4];
    btScalar angular[4];
};

/// What setting up rows needs of a body, in groups of four numbers that kernels transpose.
struct alignas(8 * sizeof(btScalar)) SolverBodyState
{
    /// Velocity before the step, with what `force` and `torque` add. The fourth numbers here are the inverse mass along
    /// an axis, with the linear factor as often as Bullet applies it to an impulse.
    btScalar linear[3], inverseMassX, angular[3], inverseMassY;
    /// What forces, torques and gyroscopic terms add to the velocity in the step.
    btScalar force[3], inverseMassZ, torque[3], inverseMass;
    /// Centre of mass, upper half of the inverse inertia in the world, angular factor.
    btScalar centre[3], factorX, inertiaXX, inertiaXY, inertiaXZ, factorY;
    btScalar inertiaYY, inertiaYZ, inertiaZZ, factorZ, unused[4];
};
static_assert(sizeof(SolverBodyState) == 32 * sizeof(btScalar));

/// Index of the body that all static objects are: its mass is infinite and its velocity zero.
constexpr std::uint32_t kFixedBody = 0;

/// The bodies of each lane. A lane without a manifold or joint has the fixed one twice.
struct BlockBodies
{
    std::uint32_t a[kBlock], b[kBlock];
    BlockOfVectors inverseMassA, inverseMassB;
    std::uint8_t movesA, movesB;  ///< a bit a lane: whether rows change the body

    struct Body
    {
        std::uint32_t number;
        bool isMoved;
    };
    /// Gives the fixed body to all lanes.
    void clear()
    {
        for (int lane = 0; lane < kBlock; ++lane)
            a[lane] = b[lane] = kFixedBody;
        movesA = movesB = 0;
    }
    void set(std::uint32_t lane, const Body& bodyA, const Body& bodyB)
    {
        a[lane] = bodyA.number;
        b[lane] = bodyB.number;
        movesA |= static_cast<std::uint8_t>(bodyA.isMoved << lane);
        movesB |= static_cast<std::uint8_t>(bodyB.isMoved << lane);
    }
};

/// The rows of a block along one direction each; one row a lane.
struct RowBlock
{
    BlockOfVectors direction;     ///< of the force on body A; body B gets the opposite
    BlockOfVectors armA, armB;    ///< angular parts of the Jacobian
    BlockOfVectors turnA, turnB;  ///< change of the angular velocities by an impulse of one
    /// Impulse to apply while no velocity has changed. In a soft step: the gap of a normal, the velocity wanted of friction.
    BlockOf target;
    BlockOf
        softness;  ///< part of the impulse by which the row yields; of a soft normal: impulse up to which it does not
    BlockOf inverse;  ///< impulse for a change of the velocity by one; 0 where the lane has no row
    BlockOf impulse;  ///< applied so far
    /// Of friction: coefficient. Of a normal in a soft step: the velocity wanted after a bounce.
    BlockOf bound;
};

/// Numbers of the rows of the k-th points of a block's manifolds. The row of the normal is followed by one or two of
/// sliding friction, which Step says, and three of turning friction.
struct PointRows
{
    static constexpr std::uint32_t kNoPush = ~std::uint32_t{0};
    std::uint32_t first;  ///< the normal's row
    std::uint32_t push;   ///< index of the PushBlock; kNoPush: no point is deep, and the step not soft
    bool turns;           ///< whether there is turning friction
    bool isDeep;          ///< whether the split impulse moves a point
};

/// Pushes deep points apart without giving them a velocity (split impulse). In a soft step, what all points remember of
/// their normals' impulses.
struct PushBlock
{
    BlockOf target;   ///< in a soft step: the largest impulse of a substep
    BlockOf impulse;  ///< in a soft step: the sum over substeps
};

/// Up to eight manifolds of one colour: no two of them move the same body.
struct ContactBlock
{
    BlockBodies bodies;
    std::uint32_t manifolds[kBlock];  ///< numbers of the first `lanes` manifolds
    std::uint8_t lanes;
    std::uint8_t points;  ///< of the manifold that has most
    bool isPlain;         ///< whether its points have nothing that few points have (Contact)
    PointRows rows[4];
};

/// Rows of joints, one a lane.
struct JointRowBlock
{
    BlockOfVectors linearA, armA, linearB, armB;  ///< the Jacobian
    BlockOfVectors turnA, turnB;                  ///< as in RowBlock
    BlockOf target;  ///< as in RowBlock; before setting up, the velocity wanted for the error
    BlockOf softness, inverse, impulse;
    BlockOf least, most;  ///< bounds of the impulse
    BlockOf isLasting;    ///< 1: of a motor or spring; 0: removes an error of places
    BlockOf relaxed;      ///< the target of a soft step's relaxation
    BlockOf sum;          ///< of the impulses of a soft step's substeps
};

/// Up to eight joints of one colour.
struct JointBlock
{
    BlockBodies bodies;
    std::uint32_t joints[kBlock];  ///< numbers of the first `lanes` joints
    std::uint8_t lanes;
    std::uint8_t rows;         ///< of the joint that has most
    std::uint32_t first;       ///< row
    std::uint32_t iterations;  ///< which all lanes take part in
    BlockOf damping;           ///< share of the velocity that the rows take away
};

/// A contact as a spring and a damper that yield by a share of the impulse (Erin Catto, "Solver2D", 2024).
struct SoftContact
{
    btScalar approach;  ///< velocity for a depth of one, 1 / s
    btScalar mass;      ///< share of the impulse that would be needed without the spring
    btScalar yield;     ///< share of the impulse so far that is taken back
};

/// A soft step's substep.
struct SoftStep
{
    btScalar inverseTime;       ///< of the substep, 1 / s
    btScalar mostPush;          ///< largest velocity that overlap causes, m / s
    SoftContact moving, fixed;  ///< between two bodies that move; else
    bool pushes;                ///< overlap causes a velocity; false in relaxation, which takes it away again
};

/// Numbers that all rows of a step share; names of btContactSolverInfo where it has them.
struct SolverStep
{
    btScalar inverseTime;     ///< 1 / s
    btScalar relaxation;      ///< m_sor
    btScalar warmStart;       ///< 0 without warm starting
    btScalar pushBelow;       ///< gaps of at most this are pushed apart; below any gap without split impulse
    btScalar bounceAbove;     ///< m_restitutionVelocityThreshold
    btScalar anchorVelocity;  ///< m_frictionERP / m_timeStep
    btScalar slop;            ///< m_linearSlop
    /// Of points without their own: m_globalCfm / m_timeStep, m_erp2.
    btScalar softness, errorReduction;
    int slidingRows;  ///< 1 or 2
    bool slidesAlongVelocity;
    bool keepsSlides;    ///< points remember directions that do not depend on the velocity
    bool notesResidual;  ///< whether iterations may end early
    bool interleaves;    ///< friction of a colour's contacts comes before the normals of the next one's
    bool isSoft;
    int jointPasses;  ///< of a soft step
    btScalar share;   ///< of a substep in the step; 1 without substeps
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
