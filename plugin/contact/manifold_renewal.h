// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// btPersistentManifold::getCacheEntry() without a btManifoldPoint: index of the point to be replaced, or -1.
inline int placeOf(const btVector3& localA, const btPersistentManifold& manifold)
{
    const btScalar threshold = manifold.getContactBreakingThreshold();
    btScalar shortest = threshold * threshold;
    int found = -1;
    for (int i = 0; i < manifold.getNumContacts(); ++i)
    {
        const btScalar distance = (manifold.getContactPoint(i).m_localPointA - localA).length2();
        if (distance < shortest)
        {
            shortest = distance;
            found = i;
        }
    }
    return found;
}

/// Removes the points of a manifold that a patch does not renew. Bullet would keep them, since its detector finds one
/// point per query; a patch is complete, and every further point costs solver time.
///
/// A point is renewed if Bullet would replace it by one of the patch, so that its impulses are kept.
class ManifoldRenewal
{
public:
    explicit ManifoldRenewal(btPersistentManifold& manifold) : m_manifold(manifold) {}

    /// Call before the points of the patch are added.
    ///
    /// @param onA position of a point of the patch on A, in world space
    void renew(const btVector3& onA)
    {
        const int found = placeOf(m_manifold.getBody0()->getWorldTransform().invXform(onA), m_manifold);
        if (found >= 0)
            m_renewed |= 1u << found;
    }

    /// Removes the points that are not renewed. If none is renewed, the first stays until removeFirst(): a manifold
    /// that is empty for a moment would trigger gContactEndedCallback.
    void removeOthers()
    {
        m_isFirstStale = m_renewed == 0 && m_manifold.getNumContacts() > 0;
        for (int i = m_manifold.getNumContacts() - 1; i >= (m_isFirstStale ? 1 : 0); --i)
        {
            if ((m_renewed >> i & 1u) == 0)
                m_manifold.removeContactPoint(i);
        }
    }

    /// Whether removeFirst() is needed.
    bool isFirstStale() const { return m_isFirstStale; }

    /// Call after each added point.
    void removeFirst()
    {
        if (m_isFirstStale && m_manifold.getNumContacts() > 1)
        {
            m_manifold.removeContactPoint(0);
            m_isFirstStale = false;
        }
    }

private:
    btPersistentManifold& m_manifold;
    unsigned m_renewed = 0;  ///< bit i: point i
    bool m_isFirstStale = false;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
