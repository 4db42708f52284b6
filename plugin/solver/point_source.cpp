// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver/point_source.h"

#include "cullet/plugin/solver/lane_vectors.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>
#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
bool has(const btManifoldPoint& point, int flag)
{
    return (point.m_contactPointFlags & flag) != 0;
}

void clearDirections(PointSource& source)
{
    source.hasDirections = true;
    source.slideVelocity[0] = source.slideVelocity[1] = {};
    source.slideSoftness = {};
    source.anchor = {};
}

void clearTurns(PointSource& source)
{
    source.turns = true;
    source.spinning = {};
    source.rolling = {};
    source.roll[0] = source.roll[1] = {};
}

/// How far a point yields, as Bullet derives it from what the application set.
void readSoftness(const btContactSolverInfo& info, const btManifoldPoint& point, int lane,
                  PointSource& source)
{
    btScalar softness = info.m_globalCfm, errorReduction = info.m_erp2;
    if (has(point, BT_CONTACT_FLAG_HAS_CONTACT_CFM | BT_CONTACT_FLAG_HAS_CONTACT_ERP))
    {
        if (has(point, BT_CONTACT_FLAG_HAS_CONTACT_CFM))
            softness = point.m_contactCFM;
        if (has(point, BT_CONTACT_FLAG_HAS_CONTACT_ERP))
            errorReduction = point.m_contactERP;
    }
    else if (has(point, BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING))
    {
        const btScalar spring = info.m_timeStep * point.m_combinedContactStiffness1;
        const btScalar sum = std::max(spring + point.m_combinedContactDamping1, btScalar(SIMD_EPSILON));
        softness = 1 / sum;
        errorReduction = spring / sum;
    }
    source.softness.lane[lane] = softness / info.m_timeStep;
    source.errorReduction.lane[lane] = errorReduction;
}

void applyAnisotropy(const btCollisionObject& object, int mode, btVector3& direction)
{
    if (!object.hasAnisotropicFriction(mode))
        return;
    const btMatrix3x3& basis = object.getWorldTransform().getBasis();
    direction = basis * (direction * basis * object.getAnisotropicFriction());
}

void readDirections(const btContactSolverInfo& info, const btManifoldPoint& point, int lane,
                    PointSource& source)
{
    const bool keeps = (info.m_solverMode & SOLVER_ENABLE_FRICTION_DIRECTION_CACHING) != 0 &&
                       has(point, BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED);
    const bool isAnchored = has(point, BT_CONTACT_FLAG_FRICTION_ANCHOR);
    source.keeps[lane] = keeps;
    if (!keeps && !isAnchored)
        return;
    if (!source.hasDirections)
        clearDirections(source);
    source.anchor.lane[lane] = isAnchored ? 1 : 0;
    if (!keeps)
        return;
    source.slideVelocity[0].lane[lane] = point.m_contactMotion1;
    source.slideVelocity[1].lane[lane] = point.m_contactMotion2;
    source.slideSoftness.lane[lane] = point.m_frictionCFM;
}

void readTurns(const btManifoldPoint& point, int lane, PointSource& source)
{
    if (!(point.m_combinedRollingFriction > 0))
        return;
    if (!source.turns)
        clearTurns(source);
    source.spinning.lane[lane] = point.m_combinedSpinningFriction;
    source.rolling.lane[lane] = point.m_combinedRollingFriction;
    btVector3 axes[2];
    btPlaneSpace1(point.m_normalWorldOnB, axes[0], axes[1]);
    for (int i = 0; i < 2; ++i)
    {
        axes[i].normalize();
        for (const auto& side : source.objects)
            applyAnisotropy(*side[lane], btCollisionObject::CF_ANISOTROPIC_ROLLING_FRICTION, axes[i]);
        setLane(source.roll[i], lane, axes[i].length() > btScalar(0.001) ? axes[i] : btVector3(0, 0, 0));
    }
}

}  // namespace

LivePoints::LivePoints(btPersistentManifold& manifold, unsigned mask)
{
    for (int i = 0; mask != 0; ++i, mask >>= 1)
    {
        if ((mask & 1) != 0)
            points[count++] = &manifold.getContactPoint(i);
    }
}

unsigned livePointsOf(const btPersistentManifold& manifold)
{
    const btScalar threshold = manifold.getContactProcessingThreshold();
    unsigned mask = 0;
    for (int i = 0; i < manifold.getNumContacts(); ++i)
        mask |= unsigned(manifold.getContactPoint(i).getDistance() <= threshold) << i;
    return mask;
}

bool isAnisotropic(const btCollisionObject& object)
{
    return object.hasAnisotropicFriction(btCollisionObject::CF_ANISOTROPIC_FRICTION);
}

void BlockPoints::choose(int k, PointSource& source) const
{
    for (int lane = 0; lane < kBlock; ++lane)
        source.points[lane] = lane < lanes && k < live[lane].count ? live[lane].points[k] : nullptr;
}

void readRarities(const btContactSolverInfo& info, const BlockPoints& points, bool turns, PointSource& source)
{
    source.hasDirections = source.turns = false;
    source.isPlain = points.isPlain;
    if (points.isPlain && !turns)
        return;
    for (int lane = 0; lane < kBlock; ++lane)
    {
        source.keeps[lane] = false;
        if (source.points[lane] == nullptr)
            continue;
        const btManifoldPoint& point = *source.points[lane];
        source.objects[0][lane] = points.manifolds[lane]->getBody0();
        source.objects[1][lane] = points.manifolds[lane]->getBody1();
        readSoftness(info, point, lane, source);
        readDirections(info, point, lane, source);
        readTurns(point, lane, source);
    }
}

namespace
{
/// Scales a lane's directions where a body has anisotropic friction.
void turnSlides(const SolverStep& step, int lane, PointSource& source)
{
    constexpr int kMode = btCollisionObject::CF_ANISOTROPIC_FRICTION;
    const btCollisionObject* const objects[] = {source.objects[0][lane], source.objects[1][lane]};
    if (!objects[0]->hasAnisotropicFriction(kMode) && !objects[1]->hasAnisotropicFriction(kMode))
        return;
    for (int i = 0; i < step.slidingRows; ++i)
    {
        btVector3 direction = laneOf(source.slide[i], lane);
        // Bullet's second direction is beside the first one as anisotropy has left it.
        if (i == 1 && source.isSliding.lane[lane] != 0)
            direction = laneOf(source.slide[0], lane).cross(source.points[lane]->m_normalWorldOnB);
        if (i == 1 && direction.length2() > SIMD_EPSILON)
            direction.normalize();
        for (const btCollisionObject* object : objects)
            applyAnisotropy(*object, kMode, direction);
        setLane(source.slide[i], lane, direction);
    }
}
}  // namespace

void finishSlides(const SolverStep& step, PointSource& source)
{
    for (int lane = 0; lane < kBlock; ++lane)
    {
        if (source.points[lane] == nullptr)
            continue;
        btManifoldPoint& point = *source.points[lane];
        if (source.keeps[lane])
        {
            setLane(source.slide[0], lane, point.m_lateralFrictionDir1);
            setLane(source.slide[1], lane, point.m_lateralFrictionDir2);
            continue;
        }
        turnSlides(step, lane, source);
        point.m_lateralFrictionDir1 = laneOf(source.slide[0], lane);
        point.m_lateralFrictionDir2 = laneOf(source.slide[1], lane);
        if (step.keepsSlides)
            point.m_contactPointFlags |= BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED;
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
