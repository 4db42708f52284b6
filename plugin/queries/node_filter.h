// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/queries/bullet_nodes.h"

#include <LinearMath/btAabbUtil2.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Which leaves Bullet's own sweep would visit: it leaves out a triangle that the shape touches by its margin alone.
class NodeFilter
{
public:
    /// Leaves that a moving box passes, as btBvhTriangleMeshShape::performConvexcast() does.
    static NodeFilter alongPath(const BulletNodes& nodes, const btVector3& from, const btVector3& to,
                                const btVector3& boxMin, const btVector3& boxMax)
    {
        NodeFilter filter(nodes);
        filter.m_isPath = true;
        filter.m_from = from;
        filter.m_boxMin = boxMin;
        filter.m_boxMax = boxMax;
        btVector3 low = from, high = from;
        low.setMin(to);
        high.setMax(to);
        nodes.setQuery(low + boxMin, high + boxMax, filter.m_query);
        btVector3 direction = to - from;
        direction.safeNormalize();
        filter.m_length = direction.dot(to - from);
        for (int axis = 0; axis < 3; ++axis)
        {
            filter.m_inverse[axis] =
                direction[axis] == btScalar(0) ? btScalar(BT_LARGE_FLOAT) : btScalar(1) / direction[axis];
            filter.m_signs[axis] = filter.m_inverse[axis] < 0 ? 1 : 0;
        }
        return filter;
    }

    /// Leaves that overlap a box, as processAllTriangles() does.
    static NodeFilter inBox(const BulletNodes& nodes, const btVector3& boxMin, const btVector3& boxMax)
    {
        NodeFilter filter(nodes);
        nodes.setQuery(boxMin, boxMax, filter.m_query);
        return filter;
    }

    bool accepts(std::uint32_t node) const
    {
        BulletBox box;
        m_nodes.readBox(node, box);
        if (!m_nodes.overlap(m_query, box))
            return false;
        if (!m_isPath)
            return true;
        const btVector3 bounds[2] = {box.min - m_boxMax, box.max - m_boxMin};
        btScalar entry = 1;
        return btRayAabb2(m_from, m_inverse, m_signs, bounds, entry, btScalar(0), m_length);
    }

private:
    explicit NodeFilter(const BulletNodes& nodes) : m_nodes(nodes) {}

    const BulletNodes& m_nodes;
    bool m_isPath = false;
    BulletBox m_query;
    btVector3 m_from, m_boxMin, m_boxMax, m_inverse;
    unsigned m_signs[3] = {};
    btScalar m_length = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
