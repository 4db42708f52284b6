// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/active_edges.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
using Eigen::Vector3d;

/// Sine and tangent of the 5 degrees below which a convex edge counts as flat, as in Jolt.
constexpr double kSineOfFlat = 0.0871557;
constexpr double kTangentOfFlat = 0.0874887;

/// Normals that differ by less are the same: the core lies on the triangle's face.
constexpr double kSameNormal = 1e-4;

/// Cosine of the angle between the normal and the way into a neighbour, from which on the neighbour is closer: more
/// than rounding errors of a normal.
constexpr double kCloser = 1e-3;

/// A neighbour that falls off by a smaller sine does not change where a body rests.
constexpr double kLevel = 5e-3;

/// Lengths that are 0 in relation to the longest edge of a triangle: its height, or a distance whose normal is rounding
/// error.
constexpr double kDegenerate = 1e-5;

/// A point is at an edge or a corner if it is closer in relation to the longest edge.
constexpr double kAtEdge = 1e-4;

/// Triangles at a corner. Where there are more, the corner counts as active.
constexpr int kMostAtCorner = 32;

Vector3d toDouble(const btVector3& v)
{
    return {double(v.x()), double(v.y()), double(v.z())};
}

bool isSame(const btVector3& a, const btVector3& b)
{
    return a.x() == b.x() && a.y() == b.y() && a.z() == b.z();
}

/// The index of a point among a triangle's corners; -1: it is none.
int indexOf(const btVector3* corners, const btVector3& point)
{
    for (int i = 0; i < 3; ++i)
    {
        if (isSame(corners[i], point))
            return i;
    }
    return -1;
}

bool isDuplicate(const btVector3* a, const btVector3* b)
{
    return indexOf(a, b[0]) >= 0 && indexOf(a, b[1]) >= 0 && indexOf(a, b[2]) >= 0;
}

/// The triangle of a contact.
struct Face
{
    /// @param inside see correctAtEdges()
    Face(const btVector3* triangle, const Vector3d& inside, const TriangleContact& contact)
        : corners(triangle)
    {
        const Vector3d origin = toDouble(triangle[0]);
        const Vector3d u = toDouble(triangle[1]) - origin, v = toDouble(triangle[2]) - origin;
        const Vector3d across = u.cross(v);
        size = std::sqrt(std::max({u.squaredNorm(), v.squaredNorm(), (u - v).squaredNorm()}));
        isDegenerate = !(across.norm() > kDegenerate * size * size);
        areApart = contact.distance > kDegenerate * size;
        if (isDegenerate)
            return;
        normal = across.normalized();
        const double along = contact.normal.dot(normal);
        // The normal of an overlap may lean to the other side at a ridge.
        const bool isClear = areApart || std::abs(along) > 0.7;
        if ((isClear ? along : (inside - origin).dot(normal)) < 0.0)
            normal = -normal;
    }

    const btVector3* corners;
    Vector3d normal = Vector3d::Zero();  ///< unit, towards the core
    double size;                         ///< the longest edge
    bool isDegenerate;                   ///< has no normal
    bool areApart;                       ///< core and triangle
};

/// What neighbours make of an edge or a corner.
struct Surroundings
{
    bool isActive = true;
    bool isCovered = false;            ///< a neighbour is closer to the core
    bool fallsOff = false;             ///< one of those that are closer is below the triangle's plane
    bool hasNext = false;              ///< there is a neighbour's face for the normal of an active edge
    Vector3d next = Vector3d::Zero();  ///< its normal, away from the mesh
};

/// Tests ways from the contact into neighbours.
class Ways
{
public:
    /// @param offset of the contact's point from the edge or corner that stands for it
    Ways(const TriangleContact& contact, bool areApart, double offset)
        : m_normal(contact.normal),
          // The way must lead closer by more than the offset may lead away.
          m_least(areApart ? std::max(kCloser, 2.0 * offset / contact.distance) : kCloser)
    {
    }

    /// @param way  unit
    /// @param rise of the way over the triangle's plane
    void add(const Vector3d& way, double rise, Surroundings& around) const
    {
        if (m_normal.dot(way) <= m_least)
            return;
        around.isCovered = true;
        around.fallsOff |= rise < -kLevel;
    }

private:
    const Vector3d& m_normal;
    double m_least;
};

/// An edge of the triangle of a contact.
struct Edge
{
    /// @param opposite index of the corner that is not on the edge
    Edge(const Face& face, int opposite)
        : a(face.corners[(opposite + 1) % 3]), b(face.corners[(opposite + 2) % 3]), start(toDouble(a))
    {
        const Vector3d whole = toDouble(b) - start;
        length = whole.norm();
        along = length > 0.0 ? Vector3d(whole / length) : Vector3d::Zero();
        outward = along.cross(face.normal);
        if (outward.dot(toDouble(face.corners[opposite]) - start) > 0.0)
            outward = -outward;
    }

    double distanceTo(const Vector3d& point) const
    {
        const double place = std::clamp((point - start).dot(along), 0.0, length);
        return (point - start - place * along).norm();
    }

    const btVector3 &a, &b;
    Vector3d start;
    double length;
    Vector3d along;    ///< unit, or 0
    Vector3d outward;  ///< unit, in the triangle's plane
};

void examineEdge(const TriangleView& triangles, const Face& face, const Edge& edge, const Ways& ways,
                 Surroundings& around)
{
    double least = 2.0;
    for (int i = 0; i < triangles.count; ++i)
    {
        const btVector3* const other = triangles.corners(i);
        const int atA = indexOf(other, edge.a);
        const int atB = atA < 0 ? -1 : indexOf(other, edge.b);
        if (atB < 0 || atA == atB || isDuplicate(other, face.corners))
            continue;
        const Vector3d spoke = toDouble(other[3 - atA - atB]) - edge.start;
        const Vector3d across = spoke - edge.along * spoke.dot(edge.along);
        const double height = across.norm();
        if (!(height > kDegenerate * spoke.norm()))
            continue;
        const Vector3d way = across / height;
        const double rise = way.dot(face.normal), advance = way.dot(edge.outward);
        // A neighbour folded onto the triangle leaves no room for a body.
        if (advance < 0.0 && std::abs(rise) < kLevel)
            continue;
        ways.add(way, rise, around);
        const bool isFallingOff = rise < 0.0 && (advance <= 0.0 || -rise > kTangentOfFlat * advance);
        around.isActive &= isFallingOff;
        // Of several, the body meets the one first that falls off least.
        const double fall = advance >= 0.0 ? -rise : 2.0 + rise;
        if (isFallingOff && fall < least)
        {
            least = fall;
            around.hasNext = true;
            around.next = advance * face.normal - rise * edge.outward;
        }
    }
}

/// The triangles around a corner, each once.
class Fan
{
public:
    Fan(const TriangleView& triangles, const Face& face, const btVector3& corner) : m_face(face)
    {
        for (int i = 0; i < triangles.count; ++i)
        {
            const btVector3* const other = triangles.corners(i);
            const int at = indexOf(other, corner);
            if (at >= 0)
                add(other, at);
        }
    }

    void examine(const btVector3& corner, const Ways& ways, Surroundings& around) const
    {
        around.isActive = m_isFull;
        for (int i = 0; i < m_count; ++i)
        {
            for (const btVector3* tip : spokes(i))
            {
                const Vector3d spoke = toDouble(*tip) - toDouble(corner);
                const double length = spoke.norm();
                if (!(length > 0.0))
                    continue;
                const double rise = spoke.dot(m_face.normal) / length;
                ways.add(spoke / length, rise, around);
                around.isActive |= rise < -kSineOfFlat || trianglesAt(*tip) < 2;
            }
        }
    }

private:
    void add(const btVector3* triangle, int at)
    {
        for (int i = 0; i < m_count; ++i)
        {
            if (isDuplicate(m_triangles[static_cast<std::size_t>(i)], triangle))
                return;
        }
        if (m_count == kMostAtCorner)
        {
            m_isFull = true;
            return;
        }
        m_triangles[static_cast<std::size_t>(m_count)] = triangle;
        m_corners[static_cast<std::size_t>(m_count++)] = at;
    }

    /// The other corners of a triangle of the fan.
    std::array<const btVector3*, 2> spokes(int i) const
    {
        const btVector3* const triangle = m_triangles[static_cast<std::size_t>(i)];
        const int at = m_corners[static_cast<std::size_t>(i)];
        return {{&triangle[(at + 1) % 3], &triangle[(at + 2) % 3]}};
    }

    int trianglesAt(const btVector3& tip) const
    {
        int found = 0;
        for (int i = 0; i < m_count; ++i)
            found += indexOf(m_triangles[static_cast<std::size_t>(i)], tip) >= 0 ? 1 : 0;
        return found;
    }

    const Face& m_face;
    std::array<const btVector3*, kMostAtCorner> m_triangles;
    std::array<int, kMostAtCorner> m_corners;
    int m_count = 0;
    bool m_isFull = false;
};

/// What surrounds the edge or the corner of a contact; of a contact inside of the triangle, nothing.
Surroundings surroundingsOf(const TriangleView& triangles, const Face& face, const TriangleContact& contact)
{
    Surroundings around;
    for (int i = 0; i < 3; ++i)
    {
        const double offset = (contact.onTriangle - toDouble(face.corners[i])).norm();
        if (offset > kAtEdge * face.size)
            continue;
        Fan(triangles, face, face.corners[i])
            .examine(face.corners[i], Ways(contact, face.areApart, offset), around);
        return around;
    }
    for (int i = 0; i < 3; ++i)
    {
        const Edge edge(face, i);
        const double offset = edge.distanceTo(contact.onTriangle);
        if (offset > kAtEdge * face.size)
            continue;
        examineEdge(triangles, face, edge, Ways(contact, face.areApart, offset), around);
        // The edges of a triangle without height coincide.
        if (!face.isDegenerate)
            return around;
    }
    around.isActive = face.isDegenerate;
    return around;
}

void turn(const Vector3d& normal, TriangleContact& contact)
{
    const Vector3d onCore = contact.onTriangle + contact.distance * contact.normal;
    contact.distance *= contact.normal.dot(normal);
    contact.normal = normal;
    contact.onTriangle = onCore - contact.distance * normal;
}
}  // namespace

EdgeVerdict correctAtEdges(const TriangleView& triangles, int which, const Vector3d& inside,
                           TriangleContact& contact)
{
    const Face face(triangles.corners(which), inside, contact);
    const double tilt = face.isDegenerate ? 1.0 : contact.normal.cross(face.normal).norm();
    const double along = contact.normal.dot(face.normal);
    if (tilt < kSameNormal && along > 0.0)
        return EdgeVerdict::Keep;
    const Surroundings around = surroundingsOf(triangles, face, contact);
    const bool isSlight = tilt < kSineOfFlat && along > 0.0;
    if (around.isCovered && face.areApart && (!isSlight || around.fallsOff))
        return EdgeVerdict::Skip;
    if (face.isDegenerate || (face.areApart && !isSlight) || (around.isActive && !around.isCovered))
        return EdgeVerdict::Keep;
    if (!around.isActive || (isSlight && !around.hasNext))
        turn(face.normal, contact);
    else if (around.hasNext)
        turn(around.next, contact);
    else
        return EdgeVerdict::Keep;
    return EdgeVerdict::Turn;
}

bool hasInternalEdges(const btCollisionShape& mesh)
{
    switch (mesh.getShapeType())
    {
        case TRIANGLE_MESH_SHAPE_PROXYTYPE:
        case MULTIMATERIAL_TRIANGLE_MESH_PROXYTYPE:
            return static_cast<const btBvhTriangleMeshShape&>(mesh).getTriangleInfoMap() != nullptr;
        case SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE:
            return static_cast<const btScaledBvhTriangleMeshShape&>(mesh)
                       .getChildShape()
                       ->getTriangleInfoMap() != nullptr;
        case TERRAIN_SHAPE_PROXYTYPE:
            return static_cast<const btHeightfieldTerrainShape&>(mesh).getTriangleInfoMap() != nullptr;
        default:
            return false;
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
