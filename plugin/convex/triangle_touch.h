// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/mid/triangle_pair.h"
#include "cullet/plugin/contact/contact_patch.h"
#include "cullet/plugin/convex/convex_pair.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The distance of two triangles without a search; see findTouch().
class TriangleTouch
{
public:
    /// @pre both shapes are triangles with finite corners
    TriangleTouch(const ConvexPair& pair, btScalar limit);

    TrianglePairState state() const { return m_state; }
    /// Valid for Near and Apart.
    const Eigen::Vector3d& normal() const { return m_touch.normal; }
    /// Valid for Near.
    Touch touchOf(const ConvexCores& cores) const;

private:
    Eigen::Vector3d m_anchor;  ///< place in the world to which points are relative
    TrianglePairTouch m_touch;
    TrianglePairState m_state;
};

inline bool areFiniteTriangles(const ConvexPair& pair)
{
    return pair.a.kind == ConvexKind::Triangle && pair.b.kind == ConvexKind::Triangle && pair.a.hasPoints() &&
           pair.b.hasPoints();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
