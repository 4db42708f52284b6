// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The part of TrianglePass that corrects contacts at edges inside of a mesh (IsaGjkOptions::activeEdges).
#include "cullet/plugin/mesh/face_touch.h"
#include "cullet/plugin/mesh/triangle_pass.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// @param contact [in, out] in the mesh's frame
EdgeVerdict TrianglePass::correctAt(const TriangleBatch::Triangle& triangle, TriangleContact& contact)
{
    const std::vector<TriangleBatch::Triangle>& all = m_query.candidates;
    // Triangles come in the order of the candidates.
    while (m_candidate < all.size() && !areSame(all[m_candidate], triangle))
        ++m_candidate;
    if (m_candidate == all.size())
        return EdgeVerdict::Keep;
    const TriangleView view = {all[0].corners, sizeof(all[0]), static_cast<int>(all.size())};
    const Eigen::Vector3d inside = m_frame.toMesh(m_search->centre());
    return correctAtEdges(view, static_cast<int>(m_candidate), inside, contact);
}

/// Corrects the last touch at an edge that a neighbour covers.
///
/// @return false if a neighbour has the contact
bool TrianglePass::correct(const TriangleSearch::Corners& corners, const TriangleBatch::Triangle& triangle)
{
    TriangleContact contact = {m_frame.turnedToMesh(m_search->normal()),
                               m_frame.toMesh(m_search->touchedPoint()), m_search->distance()};
    switch (correctAt(triangle, contact))
    {
        case EdgeVerdict::Keep:
            return true;
        case EdgeVerdict::Turn:
            m_search->turnTouch(corners, m_frame.meshBasis() * contact.normal,
                                m_frame.meshBasis() * contact.onTriangle + m_frame.meshOrigin(),
                                contact.distance);
            return true;
        default:
            return false;
    }
}

/// Corrects a point of Bullet's algorithm, likewise.
///
/// @param point [in, out]
/// @return false if a neighbour has the contact
bool TrianglePass::correct(MeshPoint& point)
{
    const double margins = double(m_side.margin) + double(m_limits.meshMargin);
    const Eigen::Vector3d onTriangle =
        point.place - (point.distance + double(m_limits.meshMargin)) * point.normal;
    TriangleContact contact = {m_frame.turnedToMesh(point.normal), m_frame.toMesh(onTriangle),
                               point.distance + margins};
    const bool isDeep = contact.distance < 0.0;
    const EdgeVerdict verdict = correctAt(point.triangle, contact);
    if (verdict != EdgeVerdict::Turn)
        return verdict == EdgeVerdict::Keep;
    point.normal = m_frame.meshBasis() * contact.normal;
    Eigen::Vector3d on = m_frame.meshBasis() * contact.onTriangle + m_frame.meshOrigin();
    double distance = contact.distance;
    const btVector3(&named)[3] = point.triangle.corners;
    const Eigen::Vector3d corners[3] = {m_frame.ofMesh(named[0]), m_frame.ofMesh(named[1]),
                                        m_frame.ofMesh(named[2])};
    const Eigen::Vector3d lowest = m_search->farthestAlong(-point.normal);
    const double height = point.normal.dot(lowest - corners[0]);
    if (isDeep && isOver(corners, lowest - height * point.normal))
    {
        distance = height;
        on = lowest - height * point.normal;
    }
    point.distance = distance - margins;
    point.place = on + (distance - double(m_side.margin)) * point.normal;
    return point.distance <= double(m_limits.breakingThreshold);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
