// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/serial_reason.h"

#include "cullet/plugin/core/dynamic_type.h"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btMinkowskiPenetrationDepthSolver.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
bool hasContactCallback()
{
    return gContactAddedCallback != nullptr || gContactProcessedCallback != nullptr ||
           gContactStartedCallback != nullptr || gContactEndedCallback != nullptr ||
           gContactDestroyedCallback != nullptr;
}

bool hasCombinedCallback()
{
    return gCalculateCombinedRestitutionCallback != &btManifoldResult::calculateCombinedRestitution ||
           gCalculateCombinedFrictionCallback != &btManifoldResult::calculateCombinedFriction ||
           gCalculateCombinedRollingFrictionCallback != &btManifoldResult::calculateCombinedRollingFriction ||
           gCalculateCombinedSpinningFrictionCallback !=
               &btManifoldResult::calculateCombinedSpinningFriction ||
           gCalculateCombinedContactDampingCallback != &btManifoldResult::calculateCombinedContactDamping ||
           gCalculateCombinedContactStiffnessCallback != &btManifoldResult::calculateCombinedContactStiffness;
}

bool isOfBullet(btConvexPenetrationDepthSolver* solver)
{
    return solver == nullptr || isExactly<btGjkEpaPenetrationDepthSolver>(*solver) ||
           isExactly<btMinkowskiPenetrationDepthSolver>(*solver);
}
}  // namespace

SerialReason findSerialReason(const btCollisionDispatcher& dispatcher, const IsaGjkRegistration& isaGjk,
                              const btDispatcherInfo& info, bool callbacksAreThreadSafe)
{
    if (!callbacksAreThreadSafe && hasContactCallback())
        return SerialReason::ContactCallback;
    if (!callbacksAreThreadSafe && hasCombinedCallback())
        return SerialReason::CombinedCallback;
    if ((dispatcher.getDispatcherFlags() &
         btCollisionDispatcher::CD_DISABLE_CONTACTPOOL_DYNAMIC_ALLOCATION) != 0)
        return SerialReason::ManifoldLimit;
    if (info.m_enableSatConvex)
        return SerialReason::SeparatingAxisTest;
    return isOfBullet(isaGjk.stock().m_pdSolver) ? SerialReason::None : SerialReason::DepthSolver;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
