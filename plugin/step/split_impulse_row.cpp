// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/step/split_impulse_row.h"

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>

#include <cstdint>
#include <cstring>
#include <initializer_list>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Gives access to Bullet's own function.
class RowOfBullet : public btSequentialImpulseConstraintSolver
{
public:
    explicit RowOfBullet(bool isSimd) { setupSolverFunctions(isSimd); }
    btScalar solve(btSolverBody& bodyA, btSolverBody& bodyB, const btSolverConstraint& row)
    {
        return m_resolveSplitPenetrationImpulse(bodyA, bodyB, row);
    }
};

/// Numbers whose products need rounding.
class Numbers
{
public:
    btScalar next()
    {
        m_state = m_state * 6364136223846793005u + 1442695040888963407u;
        return btScalar(static_cast<std::int32_t>(m_state >> 32)) / btScalar(1 << 30);
    }
    btVector3 nextVector()
    {
        const btScalar x = next(), y = next();
        return {x, y, next()};
    }

private:
    std::uint64_t m_state = 1;
};

/// Two bodies and a row between them.
struct Case
{
    explicit Case(Numbers& numbers)
    {
        for (btSolverBody& body : bodies)
            fill(body, numbers);
        row.m_contactNormal1 = numbers.nextVector();
        row.m_contactNormal2 = numbers.nextVector();
        row.m_relpos1CrossNormal = numbers.nextVector();
        row.m_relpos2CrossNormal = numbers.nextVector();
        row.m_angularComponentA = numbers.nextVector();
        row.m_angularComponentB = numbers.nextVector();
        row.m_jacDiagABInv = numbers.next();
        row.m_rhsPenetration = numbers.next();
        row.m_cfm = numbers.next();
        row.m_appliedPushImpulse = numbers.next();
        row.m_lowerLimit = btScalar(-0.5);
    }

    static void fill(btSolverBody& body, Numbers& numbers)
    {
        // A row moves bodies only, and reads no member of this one.
        alignas(16) static char someBody[16];
        body.m_originalBody = reinterpret_cast<btRigidBody*>(someBody);
        body.internalSetInvMass(numbers.nextVector());
        body.m_angularFactor = numbers.nextVector();
        body.m_linearFactor = numbers.nextVector();
        body.m_pushVelocity = numbers.nextVector();
        body.m_turnVelocity = numbers.nextVector();
    }

    btSolverBody bodies[2];
    btSolverConstraint row;
};

bool haveSameBits(const btVector3& a, const btVector3& b)
{
    return std::memcmp(&a.x(), &b.x(), 3 * sizeof(btScalar)) == 0;
}

bool haveSameBits(const btSolverBody& a, const btSolverBody& b)
{
    return haveSameBits(a.m_pushVelocity, b.m_pushVelocity) &&
           haveSameBits(a.m_turnVelocity, b.m_turnVelocity);
}

btScalar solveScalarRow(btSolverBody& bodyA, btSolverBody& bodyB, const btSolverConstraint& row)
{
    btScalar impulse = 0;
    if (row.m_rhsPenetration != btScalar(0))
    {
        impulse = row.m_rhsPenetration - btScalar(row.m_appliedPushImpulse) * row.m_cfm;
        const btScalar velocityA = row.m_contactNormal1.dot(bodyA.internalGetPushVelocity()) +
                                   row.m_relpos1CrossNormal.dot(bodyA.internalGetTurnVelocity());
        const btScalar velocityB = row.m_contactNormal2.dot(bodyB.internalGetPushVelocity()) +
                                   row.m_relpos2CrossNormal.dot(bodyB.internalGetTurnVelocity());
        impulse -= velocityA * row.m_jacDiagABInv;
        impulse -= velocityB * row.m_jacDiagABInv;
        btScalar sum = btScalar(row.m_appliedPushImpulse) + impulse;
        if (sum < row.m_lowerLimit)
        {
            impulse = row.m_lowerLimit - btScalar(row.m_appliedPushImpulse);
            sum = row.m_lowerLimit;
        }
        row.m_appliedPushImpulse = sum;
        bodyA.internalApplyPushImpulse(row.m_contactNormal1 * bodyA.internalGetInvMass(),
                                       row.m_angularComponentA, impulse);
        bodyB.internalApplyPushImpulse(row.m_contactNormal2 * bodyB.internalGetInvMass(),
                                       row.m_angularComponentB, impulse);
    }
    // In double for any precision, as Bullet writes it.
    return btScalar(impulse * (1. / row.m_jacDiagABInv));
}

/// In the order of _mm_add_ps() in Bullet's function for SSE.
btScalar dotInSimdOrder(const btVector3& a, const btVector3& b)
{
    return a.x() * b.x() + (a.y() * b.y() + a.z() * b.z());
}

void addScaled(btVector3& velocity, const btVector3& direction, btScalar impulse)
{
    for (int axis = 0; axis < 3; ++axis)
        velocity[axis] += direction[axis] * impulse;
}

void addImpulse(btSolverBody& body, const btVector3& normal, const btVector3& angular, btScalar impulse)
{
    btVector3 linear;
    for (int axis = 0; axis < 3; ++axis)
        linear[axis] = normal[axis] * body.internalGetInvMass()[axis];
    addScaled(body.internalGetPushVelocity(), linear, impulse);
    addScaled(body.internalGetTurnVelocity(), angular, impulse);
}

btScalar solveSimdRow(btSolverBody& bodyA, btSolverBody& bodyB, const btSolverConstraint& row)
{
    if (row.m_rhsPenetration == btScalar(0))
        return 0;
    const btScalar applied = row.m_appliedPushImpulse;
    btScalar impulse = row.m_rhsPenetration - applied * row.m_cfm;
    const btScalar velocityA = dotInSimdOrder(row.m_contactNormal1, bodyA.internalGetPushVelocity()) +
                               dotInSimdOrder(row.m_relpos1CrossNormal, bodyA.internalGetTurnVelocity());
    const btScalar velocityB = dotInSimdOrder(row.m_contactNormal2, bodyB.internalGetPushVelocity()) +
                               dotInSimdOrder(row.m_relpos2CrossNormal, bodyB.internalGetTurnVelocity());
    impulse -= velocityA * row.m_jacDiagABInv;
    impulse -= velocityB * row.m_jacDiagABInv;
    btScalar sum = applied + impulse;
    if (sum < row.m_lowerLimit)
    {
        impulse = row.m_lowerLimit - applied;
        sum = row.m_lowerLimit;
    }
    row.m_appliedPushImpulse = sum;
    addImpulse(bodyA, row.m_contactNormal1, row.m_angularComponentA, impulse);
    addImpulse(bodyB, row.m_contactNormal2, row.m_angularComponentB, impulse);
    return btScalar(impulse * (1. / row.m_jacDiagABInv));
}

/// Compares a function with Bullet's for many rows.
bool solvesAsBullet(SplitImpulseRow solve, bool isSimd)
{
    RowOfBullet bullet(isSimd);
    Numbers numbers;
    for (int i = 0; i < 64; ++i)
    {
        Numbers same = numbers;
        Case own(numbers), theirs(same);
        const btScalar residual = solve(own.bodies[0], own.bodies[1], own.row);
        const btScalar expected = bullet.solve(theirs.bodies[0], theirs.bodies[1], theirs.row);
        if (residual != expected ||
            btScalar(own.row.m_appliedPushImpulse) != btScalar(theirs.row.m_appliedPushImpulse) ||
            !haveSameBits(own.bodies[0], theirs.bodies[0]) || !haveSameBits(own.bodies[1], theirs.bodies[1]))
            return false;
    }
    return true;
}

SplitImpulseRow findRowOfBullet(bool isSimd)
{
    for (const SplitImpulseRow row : {solveScalarRow, solveSimdRow})
    {
        if (solvesAsBullet(row, isSimd))
            return row;
    }
    return nullptr;
}
}  // namespace

SplitImpulseRow splitImpulseRowOfBullet(bool isSimd)
{
    static const SplitImpulseRow scalar = findRowOfBullet(false);
    static const SplitImpulseRow simd = findRowOfBullet(true);
    return isSimd ? simd : scalar;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
