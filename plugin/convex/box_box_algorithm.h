// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/box/box_contact.h"
#include "cullet/plugin/convex/isa_gjk_registration.h"
#include "cullet/plugin/convex/kept_contacts.h"

#include <BulletCollision/CollisionDispatch/btActivatingCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The contacts of two boxes, with their margins; replaces btBoxBoxCollisionAlgorithm and keeps its manifold as that
/// does: created with the algorithm, points added only while the boxes touch, and removed when they have parted by the
/// breaking threshold. See collideBoxes().
///
/// Between calls it keeps the manifold and which axes separated the boxes last, which changes no result.
class BoxBoxAlgorithm final : public btActivatingCollisionAlgorithm
{
public:
    /// @param manifold the manifold of a parent algorithm, which owns and refreshes it; null: an own one
    BoxBoxAlgorithm(IsaGjkRegistration& isaGjk, btPersistentManifold* manifold,
                    const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
                    const btCollisionObjectWrapper* b);
    ~BoxBoxAlgorithm() override;

    void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                          const btDispatcherInfo& info, btManifoldResult* result) override;
    /// 1, as of Bullet's.
    btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                   btManifoldResult*) override
    {
        return 1;
    }
    void getAllContactManifolds(btManifoldArray& manifolds) override
    {
        if (m_ownsManifold)
            manifolds.push_back(m_manifold);
    }

private:
    void count(bool isTouching);
    void report(const BoxContact<btScalar>& contact, const ContactCall& call);

    ContactKeeper m_keeper;
    btPersistentManifold* m_manifold;
    bool m_ownsManifold = false;
    BoxAxisGroup m_group = BoxAxisGroup::None;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
