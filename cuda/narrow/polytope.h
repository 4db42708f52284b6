// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/cuda/narrow/posed_pair.h"
#include "cullet/cuda/narrow/turn.h"

#include <cmath>
#include <cstdint>

/// The polytope of a depth search, which grows within A - B.
namespace cullet::convex
{
/// Memory for the polytopes of some lanes. Element i of all lanes is stored side by side, since the threads of a GPU
/// read the same element of their lanes together.
struct PolytopeMemory
{
    double* numbers = nullptr;         ///< [numbersOf(capacity) lanes]
    VertexIds* ids = nullptr;          ///< [capacity lanes]
    std::uint16_t* indices = nullptr;  ///< [indicesOf(capacity) lanes]
    std::uint32_t lanes = 0;

    /// Coordinates of vertices; normals and distances of faces.
    static constexpr std::uint64_t numbersOf(std::uint64_t capacity) { return 11 * capacity; }
    /// Corners of faces, the visible faces, and the horizon.
    static constexpr std::uint64_t indicesOf(std::uint64_t capacity) { return 9 * capacity; }
};

/// An array of one lane.
template <class T>
class LaneArray
{
public:
    CULLET_HOST_DEVICE LaneArray(T* data, std::uint32_t lanes) : m_data(data), m_lanes(lanes) {}
    CULLET_HOST_DEVICE T& operator[](std::uint32_t i) const { return m_data[std::uint64_t{i} * m_lanes]; }
    CULLET_HOST_DEVICE LaneArray from(std::uint32_t i) const { return {&(*this)[i], m_lanes}; }

private:
    T* m_data;
    std::uint32_t m_lanes;
};

/// A closed surface of triangles, counter-clockwise from outside, whose vertices are points of A - B. Convex up to
/// rounding. No plane separates the origin from the vertices by more than the least distance of a face: A - B contains
/// the ball with that radius around the origin.
///
/// add() refuses a point for which there is no room, or that would break the surface.
class GrownPolytope
{
public:
    /// The plane of a face.
    struct Plane
    {
        Vec<double> normal;  ///< unit, outward
        double distance;     ///< from the origin, negative where the origin is outside
    };

    struct Face
    {
        std::uint32_t index;
        Plane plane;
    };

    /// A point of the surface as a mean of vertices.
    struct Foot
    {
        std::uint32_t vertex[3];
        double weights[3];
        double miss;  ///< distance from where it should be
    };

    enum class Growth
    {
        Grown,
        Full,   ///< there is no room
        Broken  ///< the surface would have a hole or a face without a normal; it is void from then on
    };

    /// @param capacity most vertices, at least 4 and less than 2^15; there are at most 2 capacity - 4 faces
    /// @param size     unit of tolerances
    CULLET_HOST_DEVICE GrownPolytope(const PolytopeMemory& memory, std::uint32_t lane, std::uint32_t capacity,
                                     double size)
        : m_points(memory.numbers + lane, memory.lanes),
          m_planes(m_points.from(3 * capacity)),
          m_ids(memory.ids + lane, memory.lanes),
          m_corners(memory.indices + lane, memory.lanes),
          m_visible(m_corners.from(6 * capacity)),
          m_next(m_corners.from(8 * capacity)),
          m_capacity(capacity),
          m_tolerance(1e-13 * size)
    {
    }

    /// @param corners not in one plane
    CULLET_HOST_DEVICE Growth setTetrahedron(const Vec<double> (&points)[4], const VertexIds (&ids)[4])
    {
        m_vertexCount = m_faceCount = 0;
        for (std::uint32_t i = 0; i < 4; ++i)
            addVertex(points[i], ids[i]);
        const Vec<double> d = points[3];
        const bool isPositive = dot(points[0] - d, cross(points[1] - d, points[2] - d)) > 0.0;
        const std::uint32_t i = isPositive ? 0 : 1, j = 1 - i;
        m_faceCount = 4;
        return setFace(0, i, j, 2) && setFace(1, j, i, 3) && setFace(2, 2, j, 3) && setFace(3, i, 2, 3)
                   ? Growth::Grown
                   : Growth::Broken;
    }

    /// The face with the least distance.
    CULLET_HOST_DEVICE Face closest() const
    {
        std::uint32_t best = 0;
        double least = INFINITY;
        for (std::uint32_t i = 0; i < m_faceCount; ++i)
        {
            const double distance = m_planes[4 * i + 3];
            if (distance < least)
            {
                least = distance;
                best = i;
            }
        }
        return {best, planeOf(best)};
    }

    CULLET_HOST_DEVICE VertexIds idsOf(std::uint32_t vertex) const { return m_ids[vertex]; }
    CULLET_HOST_DEVICE std::uint32_t cornerOf(std::uint32_t face, std::uint32_t k) const
    {
        return m_corners[3 * face + k];
    }
    CULLET_HOST_DEVICE std::uint32_t vertexCount() const { return m_vertexCount; }

    /// Adds a point of A - B that is outside of the surface.
    CULLET_HOST_DEVICE Growth add(const Vec<double>& point, VertexIds ids)
    {
        const std::uint32_t visible = collectVisible(point);
        std::uint32_t start = 0;
        const std::uint32_t edges = collectHorizon(visible, start);
        if (edges < 3 || !isOneWalk(start, edges))
            return Growth::Broken;
        if (m_vertexCount == m_capacity || m_faceCount + edges - visible > 2 * m_capacity)
            return Growth::Full;
        const std::uint32_t vertex = m_vertexCount;
        addVertex(point, ids);
        return setFan(vertex, start, edges, visible) ? Growth::Grown : Growth::Broken;
    }

    /// Where the ray from the origin along the normal of the closest face leaves the surface. Of several faces in one
    /// plane, rounding decides which is the closest; this is in the one that the ray meets.
    ///
    /// @param slack how much farther away the surface may be there than the plane of the face
    CULLET_HOST_DEVICE Foot footOf(const Face& face, double slack) const
    {
        Foot best = footIn(face.index, face.plane);
        const double reach = face.plane.distance + slack + m_tolerance;
        for (std::uint32_t i = 0; best.miss > 1e3 * m_tolerance && i < m_faceCount; ++i)
        {
            if (m_planes[4 * i + 3] > reach)
                continue;
            const Foot foot = footIn(i, face.plane);
            if (foot.miss < best.miss)
                best = foot;
        }
        return best;
    }

private:
    /// A face whose squared sine is below this is too thin: its normal is mostly rounding.
    static constexpr double kThinnest = 1e-24;

    CULLET_HOST_DEVICE Vec<double> pointOf(std::uint32_t vertex) const
    {
        return {m_points[3 * vertex], m_points[3 * vertex + 1], m_points[3 * vertex + 2]};
    }
    CULLET_HOST_DEVICE Plane planeOf(std::uint32_t face) const
    {
        return {{m_planes[4 * face], m_planes[4 * face + 1], m_planes[4 * face + 2]}, m_planes[4 * face + 3]};
    }

    CULLET_HOST_DEVICE void addVertex(const Vec<double>& point, VertexIds ids)
    {
        m_points[3 * m_vertexCount] = point.x;
        m_points[3 * m_vertexCount + 1] = point.y;
        m_points[3 * m_vertexCount + 2] = point.z;
        m_ids[m_vertexCount++] = ids;
    }

    /// @return false if the face is too thin
    CULLET_HOST_DEVICE bool setFace(std::uint32_t face, std::uint32_t i, std::uint32_t j, std::uint32_t k)
    {
        m_corners[3 * face] = static_cast<std::uint16_t>(i);
        m_corners[3 * face + 1] = static_cast<std::uint16_t>(j);
        m_corners[3 * face + 2] = static_cast<std::uint16_t>(k);
        const Vec<double> corner = pointOf(i), ij = pointOf(j) - corner, ik = pointOf(k) - corner;
        const Vec<double> scaled = cross(ij, ik);
        const double length2 = dot(scaled, scaled);
        const Vec<double> normal = scaled * (1.0 / rootOf(length2));
        m_planes[4 * face] = normal.x;
        m_planes[4 * face + 1] = normal.y;
        m_planes[4 * face + 2] = normal.z;
        m_planes[4 * face + 3] = dot(normal, corner);
        return length2 > kThinnest * (dot(ij, ij) * dot(ik, ik));
    }

    CULLET_HOST_DEVICE void moveFace(std::uint32_t from, std::uint32_t to)
    {
        for (std::uint32_t k = 0; k < 3; ++k)
            m_corners[3 * to + k] = m_corners[3 * from + k];
        for (std::uint32_t k = 0; k < 4; ++k)
            m_planes[4 * to + k] = m_planes[4 * from + k];
    }

    /// Lists the faces that are visible from a point, ascending.
    CULLET_HOST_DEVICE std::uint32_t collectVisible(const Vec<double>& point)
    {
        std::uint32_t count = 0;
        for (std::uint32_t i = 0; i < m_faceCount; ++i)
        {
            const Plane plane = planeOf(i);
            if (dot(plane.normal, point) - plane.distance > m_tolerance)
                m_visible[count++] = static_cast<std::uint16_t>(i);
        }
        return count;
    }

    /// Stores for each vertex of the horizon the next one.
    ///
    /// @param start [out] a vertex of the horizon
    /// @return the number of edges between visible faces and others
    CULLET_HOST_DEVICE std::uint32_t collectHorizon(std::uint32_t visible, std::uint32_t& start)
    {
        std::uint32_t edges = 0;
        for (std::uint32_t i = 0; i < visible; ++i)
        {
            const std::uint32_t face = m_visible[i];
            for (std::uint32_t k = 0; k < 3; ++k)
            {
                const std::uint32_t from = m_corners[3 * face + k], to = m_corners[3 * face + (k + 1) % 3];
                if (isInVisible(visible, to, from))
                    continue;
                m_next[from] = static_cast<std::uint16_t>(to);
                start = from;
                ++edges;
            }
        }
        return edges;
    }

    /// Whether a visible face has an edge in this direction.
    CULLET_HOST_DEVICE bool isInVisible(std::uint32_t visible, std::uint32_t from, std::uint32_t to) const
    {
        for (std::uint32_t i = 0; i < visible; ++i)
        {
            const std::uint32_t face = m_visible[i];
            const std::uint32_t a = m_corners[3 * face], b = m_corners[3 * face + 1],
                                c = m_corners[3 * face + 2];
            if ((a == from && b == to) || (b == from && c == to) || (c == from && a == to))
                return true;
        }
        return false;
    }

    /// Whether all edges of the horizon form one closed walk, in which each vertex has one outgoing edge.
    CULLET_HOST_DEVICE bool isOneWalk(std::uint32_t start, std::uint32_t edges) const
    {
        std::uint32_t vertex = start, count = 0;
        do
        {
            vertex = m_next[vertex];
            ++count;
        } while (vertex != start && count < edges);
        return vertex == start && count == edges;
    }

    /// Adds a face between the new vertex and each edge of the horizon: at the indices of the visible faces, then at
    /// the end. If there are fewer new faces, the last faces fill the free indices.
    ///
    /// @return false if a face is too thin
    CULLET_HOST_DEVICE bool setFan(std::uint32_t vertex, std::uint32_t start, std::uint32_t edges,
                                   std::uint32_t visible)
    {
        bool isSolid = true;
        std::uint32_t from = start;
        for (std::uint32_t i = 0; i < edges; ++i)
        {
            const std::uint32_t to = m_next[from];
            const std::uint32_t place = i < visible ? m_visible[i] : m_faceCount++;
            isSolid = setFace(place, from, to, vertex) && isSolid;
            from = to;
        }
        for (std::uint32_t i = visible; i > edges; --i)
            moveFace(--m_faceCount, m_visible[i - 1]);
        return isSolid;
    }

    /// The point of a face where a ray from the origin meets its plane, clamped to the face.
    CULLET_HOST_DEVICE Foot footIn(std::uint32_t face, const Plane& closest) const
    {
        Foot foot = {{cornerOf(face, 0), cornerOf(face, 1), cornerOf(face, 2)}, {1.0, 0.0, 0.0}, INFINITY};
        const Vec<double> a = pointOf(foot.vertex[0]), b = pointOf(foot.vertex[1]),
                          c = pointOf(foot.vertex[2]), on = closest.normal * closest.distance;
        // Weights by the areas opposite of the corners, seen along the ray.
        const double area[3] = {dot(closest.normal, cross(b - on, c - on)),
                                dot(closest.normal, cross(c - on, a - on)),
                                dot(closest.normal, cross(a - on, b - on))};
        // The ray does not leave through a face that it enters by.
        if (!(area[0] + area[1] + area[2] > 0.0))
            return foot;
        double sum = 0.0;
        for (int k = 0; k < 3; ++k)
        {
            foot.weights[k] = area[k] > 0.0 ? area[k] : 0.0;
            sum += foot.weights[k];
        }
        Vec<double> off = -on;
        const Vec<double> corners[3] = {a, b, c};
        for (int k = 0; k < 3; ++k)
        {
            foot.weights[k] /= sum;
            off = mulAdd(corners[k], foot.weights[k], off);
        }
        foot.miss = rootOf(dot(off, off));
        return foot;
    }

    LaneArray<double> m_points;          ///< [3 capacity]
    LaneArray<double> m_planes;          ///< [4 * 2 capacity] normal and distance
    LaneArray<VertexIds> m_ids;          ///< [capacity]
    LaneArray<std::uint16_t> m_corners;  ///< [3 * 2 capacity]
    LaneArray<std::uint16_t> m_visible;  ///< [2 capacity]
    LaneArray<std::uint16_t> m_next;     ///< [capacity] by vertex of the horizon
    std::uint32_t m_capacity;
    std::uint32_t m_vertexCount = 0, m_faceCount = 0;
    double m_tolerance;
};
}  // namespace cullet::convex
