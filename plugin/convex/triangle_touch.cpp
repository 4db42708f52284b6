// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/triangle_touch.h"

#include "cullet/narrow/box/four_lanes.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
using Four = FourLanes<double>;

/// Three numbers and a zero.
[[gnu::always_inline]] inline Four widened(btScalar x, btScalar y, btScalar z)
{
    return {double(x), double(y), double(z), 0.0};
}

void placeCorners(const ConvexSide& side, const Eigen::Vector3d& anchor, TriangleCorners& corners)
{
    const auto& triangle = static_cast<const btTriangleShape&>(side.shape);
    const btMatrix3x3& basis = side.transform.getBasis();
    const btVector3& origin = side.transform.getOrigin();
    const auto column = [&](int i) { return widened(basis[0][i], basis[1][i], basis[2][i]); };
    const Four columns[] = {column(0), column(1), column(2)};
    const Four offset =
        widened(origin.x(), origin.y(), origin.z()) - Four(anchor[0], anchor[1], anchor[2], 0.0);
    for (int c = 0; c < 3; ++c)
    {
        const btVector3& corner = triangle.m_vertices1[c];
        const Four placed = columns[0] * double(corner.x()) + columns[1] * double(corner.y()) +
                            columns[2] * double(corner.z()) + offset;
        corners[c] = {placed[0], placed[1], placed[2]};
    }
}
}  // namespace

TriangleTouch::TriangleTouch(const ConvexPair& pair, btScalar limit)
    : m_anchor(toEigen(pair.a.transform.getOrigin()).cast<double>())
{
    TriangleCorners a, b;
    placeCorners(pair.a, m_anchor, a);
    placeCorners(pair.b, m_anchor, b);
    m_state = findTouch(a, b, double(limit), m_touch);
}

Touch TriangleTouch::touchOf(const ConvexCores& cores) const
{
    return {m_touch.normal,  m_touch.distance, m_touch.onB + (m_anchor - cores.anchor) - cores.a->origin(),
            m_touch.cornerA, m_touch.cornerB,  m_touch.areCorners};
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
