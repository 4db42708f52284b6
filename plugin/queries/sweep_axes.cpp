// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/queries/sweep_axes.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// The point of the triangle's edges that is closest to a point.
btVector3 closestOnEdges(const btVector3* corners, const btVector3& point)
{
    btVector3 closest = corners[0];
    for (int i = 0; i < 3; ++i)
    {
        const btVector3 edge = corners[(i + 1) % 3] - corners[i];
        const btScalar length2 = edge.length2();
        const btScalar share = length2 > 0 ? (point - corners[i]).dot(edge) / length2 : btScalar(0);
        const btVector3 on = corners[i] + edge * std::clamp(share, btScalar(0), btScalar(1));
        if ((on - point).length2() < (closest - point).length2())
            closest = on;
    }
    return closest;
}
}  // namespace

btScalar SweepAxes::earliest(const btVector3* corners, btScalar until) const
{
    if (m_motion.turns)
        return 0;
    const btVector3 centre = m_motion.from + (m_motion.to - m_motion.from) * until;
    btVector3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    if (normal.dot(centre - corners[0]) < 0)
        normal = -normal;
    btVector3 nearest = centre;
    btScalar bound = reachedAt(normal, corners, until, nearest);
    // From the triangle towards the centre, then towards what of the shape is nearest along the last axis.
    nearest = centre;
    for (int i = 0; i < kMostAxes && bound <= until; ++i)
        bound =
            std::max(bound, reachedAt(nearest - closestOnEdges(corners, nearest), corners, until, nearest));
    return bound;
}

/// When the gap along an axis has closed to the reach: 0 if it has at the start, kNever if it does not close.
///
/// @param axis    towards the shape, of any length
/// @param nearest [out] the point of the shape, at `until`, that is the nearest along the axis; unchanged if that is none
btScalar SweepAxes::reachedAt(const btVector3& axis, const btVector3* corners, btScalar until,
                              btVector3& nearest) const
{
    const btScalar length = axis.length();
    // A NaN is no axis.
    if (!(length > btScalar(1e-6)))
        return 0;
    const btVector3 unit = axis / length, motion = m_motion.to - m_motion.from;
    const btScalar highest = std::max({unit.dot(corners[0]), unit.dot(corners[1]), unit.dot(corners[2])});
    const btVector3 lowest = m_motion.basis * m_shape.localGetSupportingVertex((-unit) * m_motion.basis);
    nearest = m_motion.from + motion * until + lowest;
    const btScalar room = unit.dot(m_motion.from + lowest) - highest - m_reach;
    const btScalar closing = -unit.dot(motion);
    if (!(room > 0))
        return 0;
    return closing * kNever > room ? room / closing : kNever;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
