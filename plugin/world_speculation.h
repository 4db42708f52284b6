// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <cstdint>
#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Of the last step.
struct SpeculationStats
{
    std::uint64_t bodies = 0;    ///< that moved fast enough
    std::uint64_t pairs = 0;     ///< of these with what their swept boxes overlap
    std::uint64_t queries = 0;   ///< for closest points
    std::uint64_t contacts = 0;  ///< points at a distance that were given to the solver
};

/// The part of World that finds contacts of fast bodies before they touch.
///
/// A pair is moved forward by what its closest points allow until it touches (conservative advancement). Where it does, a
/// point is added to Bullet's predictive manifolds, with the distance by which the body comes nearer until then. Bullet's
/// solver lets it approach by that distance and no more. As with Bullet's sweeps the point acts on the centre of the fast
/// body and has no restitution, unless the world applies that to predictive manifolds
/// (setApplySpeculativeContactRestitution()); friction begins with the contact of the next step. All shapes take part for
/// which the dispatcher has an algorithm for closest points; compounds and rotating bodies too. A body that only turns is
/// not fast.
///
/// Runs on the calling thread. Cost: a box query of the broad phase for each fast body, and one to twelve queries for
/// closest points for each pair with its swept box.
class CULLET_API WorldSpeculation
{
public:
    WorldSpeculation();
    ~WorldSpeculation();

    /// @param motion see World::setSpeculation()
    void setMotion(btScalar motion);
    bool isOn() const;

    /// @param predictive [out] gets manifolds, which the world releases in its next step
    /// @param timeStep   seconds
    /// Errors: std::bad_alloc, and what callbacks of the application throw.
    void find(btCollisionWorld& world, const btAlignedObjectArray<btRigidBody*>& bodies,
              btAlignedObjectArray<btPersistentManifold*>& predictive, btScalar timeStep);

    const SpeculationStats& stats() const;

private:
    struct Parts;

    std::unique_ptr<Parts> m;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
