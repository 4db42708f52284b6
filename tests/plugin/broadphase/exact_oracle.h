// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/pair.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>

#include <algorithm>
#include <vector>

namespace cullet::test
{
/// Closed intervals; false for a box with min > max or with a NaN.
inline bool overlapNow(const btBroadphaseProxy& a, const btBroadphaseProxy& b, btScalar gap = 0)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        const bool isValid = a.m_aabbMin[axis] <= a.m_aabbMax[axis] && b.m_aabbMin[axis] <= b.m_aabbMax[axis];
        const bool isNear =
            a.m_aabbMin[axis] - gap <= b.m_aabbMax[axis] && b.m_aabbMin[axis] - gap <= a.m_aabbMax[axis];
        if (!isValid || !isNear)
            return false;
    }
    return true;
}

inline bool maskRule(const btBroadphaseProxy& a, const btBroadphaseProxy& b)
{
    return (a.m_collisionFilterGroup & b.m_collisionFilterMask) != 0 &&
           (b.m_collisionFilterGroup & a.m_collisionFilterMask) != 0;
}

/// Every pair of proxies whose exact boxes overlap, O(n^2).
inline Pairs exactPairs(const std::vector<btBroadphaseProxy*>& proxies)
{
    Pairs pairs;
    for (std::size_t i = 0; i < proxies.size(); ++i)
    {
        for (std::size_t j = i + 1; j < proxies.size(); ++j)
        {
            if (overlapNow(*proxies[i], *proxies[j]))
                pairs.push_back(makePair(idOf(proxies[i]), idOf(proxies[j])));
        }
    }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

/// Whether `all` contains `some`. @pre both are sorted
inline bool containsAll(const Pairs& all, const Pairs& some)
{
    return std::includes(all.begin(), all.end(), some.begin(), some.end());
}
}  // namespace cullet::test
