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
/// Removes the points of a manifold that a patch does not renew. Bullet keeps them, since its detector finds one point per
/// query; a patch is complete, and the solver pays for every point.
///
/// A point is renewed if Bullet would replace it by one of the patch, so that its impulses are kept.
class ManifoldRenewal
{
public:
    explicit ManifoldRenewal(btPersistentManifold& manifold) : m_manifold(manifold) {}

    /// Before the points are added.
    ///
    /// @param onA of a point of the patch, in the world
    void renew(const btVector3& onA)
    {
        const int found = cacheEntry(m_manifold.getBody0()->getWorldTransform().invXform(onA));
        if (found >= 0)
            m_renewed |= 1u << found;
    }

    /// All but the first are removed here if none is renewed: a manifold that is empty for a moment would call
    /// gContactEndedCallback.
    void removeOthers()
    {
        m_isFirstStale = m_renewed == 0 && m_manifold.getNumContacts() > 0;
        for (int i = m_manifold.getNumContacts() - 1; i >= (m_isFirstStale ? 1 : 0); --i)
        {
            if ((m_renewed >> i & 1u) == 0)
                m_manifold.removeContactPoint(i);
        }
    }

    /// After a point was added.
    void removeFirst()
    {
        if (m_isFirstStale && m_manifold.getNumContacts() > 1)
        {
            m_manifold.removeContactPoint(0);
            m_isFirstStale = false;
        }
    }

private:
    /// As btPersistentManifold::getCacheEntry(): the point that would be replaced, or -1.
    int cacheEntry(const btVector3& localA) const
    {
        const btScalar threshold = m_manifold.getContactBreakingThreshold();
        btScalar shortest = threshold * threshold;
        int found = -1;
        for (int i = 0; i < m_manifold.getNumContacts(); ++i)
        {
            const btScalar distance = (m_manifold.getContactPoint(i).m_localPointA - localA).length2();
            if (distance < shortest)
            {
                shortest = distance;
                found = i;
            }
        }
        return found;
    }

    btPersistentManifold& m_manifold;
    unsigned m_renewed = 0;  ///< bit i: point i
    bool m_isFirstStale = false;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
