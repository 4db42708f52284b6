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
/// The records of a polytope. A GPU reads 16 bytes at once.
struct alignas(16) VectorXY
{
    double x, y;
};
struct alignas(16) PlaceZ
{
    double z;
    VertexIds ids;
};

/// The corners of a face, counter-clockwise from outside, in 10 bits each.
struct FaceCorners
{
    std::uint32_t bits;

    CULLET_HOST_DEVICE static FaceCorners of(std::uint32_t a, std::uint32_t b, std::uint32_t c)
    {
        return {a | b << 10 | c << 20};
    }
    CULLET_HOST_DEVICE std::uint32_t operator[](std::uint32_t k) const { return bits >> 10 * k & 0x3ffu; }
    /// The edge from corner k to the next one, as edge().
    CULLET_HOST_DEVICE std::uint32_t edgeAt(std::uint32_t k) const
    {
        return k < 2 ? bits >> 10 * k & 0xfffffu : bits >> 20 | (bits & 0x3ffu) << 10;
    }
    CULLET_HOST_DEVICE static std::uint32_t edge(std::uint32_t from, std::uint32_t to)
    {
        return from | to << 10;
    }
    CULLET_HOST_DEVICE bool hasEdge(std::uint32_t edge) const
    {
        return edgeAt(0) == edge || edgeAt(1) == edge || edgeAt(2) == edge;
    }
};

/// A face that is visible from a point.
struct VisibleFace
{
    std::uint32_t face;
    FaceCorners corners;
};

/// Memory for the polytopes of some lanes. Element i of all lanes is stored side by side, since the threads of a GPU
/// read the same element of their lanes together.
struct PolytopeMemory
{
    VectorXY* placesXY = nullptr;    ///< [capacity lanes]
    PlaceZ* placesZ = nullptr;       ///< [capacity lanes]
    VectorXY* normalsXY = nullptr;   ///< [2 capacity lanes]
    double* normalsZ = nullptr;      ///< [2 capacity lanes]
    double* distances = nullptr;     ///< [2 capacity lanes]
    FaceCorners* corners = nullptr;  ///< [2 capacity lanes]
    VisibleFace* visible = nullptr;  ///< [2 capacity lanes]
    std::uint16_t* next = nullptr;   ///< [capacity lanes] by vertex of the horizon
    std::uint32_t lanes = 0;
};

/// An array of one lane.
template <class T>
class LaneArray
{
public:
    CULLET_HOST_DEVICE LaneArray(T* data, std::uint32_t lanes) : m_data(data), m_lanes(lanes) {}
    CULLET_HOST_DEVICE T& operator[](std::uint32_t i) const { return m_data[std::uint64_t{i} * m_lanes]; }

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

    /// @param capacity most vertices, at least 4 and less than 2^10; there are at most 2 capacity - 4 faces
    /// @param size     unit of tolerances
    CULLET_HOST_DEVICE GrownPolytope(const PolytopeMemory& memory, std::uint32_t lane, std::uint32_t capacity,
                                     double size)
        : m_placesXY(memory.placesXY + lane, memory.lanes),
          m_placesZ(memory.placesZ + lane, memory.lanes),
          m_normalsXY(memory.normalsXY + lane, memory.lanes),
          m_normalsZ(memory.normalsZ + lane, memory.lanes),
          m_distances(memory.distances + lane, memory.lanes),
          m_corners(memory.corners + lane, memory.lanes),
          m_visible(memory.visible + lane, memory.lanes),
          m_next(memory.next + lane, memory.lanes),
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
        const auto set = [&](std::uint32_t face, std::uint32_t a, std::uint32_t b, std::uint32_t c)
        { return setFace(face, FaceCorners::of(a, b, c), pointOf(a), pointOf(b), pointOf(c)); };
        return set(0, i, j, 2) && set(1, j, i, 3) && set(2, 2, j, 3) && set(3, i, 2, 3) ? Growth::Grown
                                                                                        : Growth::Broken;
    }

    /// The face with the least distance.
    CULLET_HOST_DEVICE Face closest() const
    {
        std::uint32_t best = 0;
        double least = INFINITY;
        for (std::uint32_t first = 0; first < m_faceCount; first += kDistancesAtOnce)
        {
            double distances[kDistancesAtOnce];
            CULLET_UNROLL
            for (std::uint32_t k = 0; k < kDistancesAtOnce; ++k)
                distances[k] = first + k < m_faceCount ? m_distances[first + k] : double(INFINITY);
            CULLET_UNROLL
            for (std::uint32_t k = 0; k < kDistancesAtOnce; ++k)
            {
                if (distances[k] < least)
                {
                    least = distances[k];
                    best = first + k;
                }
            }
        }
        return {best, planeOf(best)};
    }

    CULLET_HOST_DEVICE VertexIds idsOf(std::uint32_t vertex) const { return m_placesZ[vertex].ids; }
    CULLET_HOST_DEVICE std::uint32_t cornerOf(std::uint32_t face, std::uint32_t k) const
    {
        return m_corners[face][k];
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
        return setFan(vertex, point, start, edges, visible) ? Growth::Grown : Growth::Broken;
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
            if (m_distances[i] > reach)
                continue;
            const Foot foot = footIn(i, face.plane);
            if (foot.miss < best.miss)
                best = foot;
        }
        return best;
    }

private:
    /// Faces that are read before the first is used.
    static constexpr std::uint32_t kAtOnce = 4, kDistancesAtOnce = 8;
    /// A face whose squared sine is below this is too thin: its normal is mostly rounding.
    static constexpr double kThinnest = 1e-24;

    CULLET_HOST_DEVICE Vec<double> pointOf(std::uint32_t vertex) const
    {
        const VectorXY place = m_placesXY[vertex];
        return {place.x, place.y, m_placesZ[vertex].z};
    }
    CULLET_HOST_DEVICE Plane planeOf(std::uint32_t face) const
    {
        const VectorXY normal = m_normalsXY[face];
        return {{normal.x, normal.y, m_normalsZ[face]}, m_distances[face]};
    }

    CULLET_HOST_DEVICE void addVertex(const Vec<double>& point, VertexIds ids)
    {
        m_placesXY[m_vertexCount] = {point.x, point.y};
        m_placesZ[m_vertexCount++] = {point.z, ids};
    }

    /// @param a, b, c the places of the corners
    /// @return false if the face is too thin
    CULLET_HOST_DEVICE bool setFace(std::uint32_t face, FaceCorners corners, const Vec<double>& a,
                                    const Vec<double>& b, const Vec<double>& c)
    {
        const Vec<double> ab = b - a, ac = c - a;
        const Vec<double> scaled = cross(ab, ac);
        const double length2 = dot(scaled, scaled);
        const Vec<double> normal = scaled * (1.0 / rootOf(length2));
        m_corners[face] = corners;
        m_normalsXY[face] = {normal.x, normal.y};
        m_normalsZ[face] = normal.z;
        m_distances[face] = dot(normal, a);
        return length2 > kThinnest * (dot(ab, ab) * dot(ac, ac));
    }

    CULLET_HOST_DEVICE void moveFace(std::uint32_t from, std::uint32_t to)
    {
        m_corners[to] = m_corners[from];
        m_normalsXY[to] = m_normalsXY[from];
        m_normalsZ[to] = m_normalsZ[from];
        m_distances[to] = m_distances[from];
    }

    /// Lists the faces that are visible from a point, ascending.
    CULLET_HOST_DEVICE std::uint32_t collectVisible(const Vec<double>& point)
    {
        std::uint32_t count = 0;
        for (std::uint32_t first = 0; first < m_faceCount; first += kAtOnce)
        {
            Plane planes[kAtOnce];
            CULLET_UNROLL
            for (std::uint32_t k = 0; k < kAtOnce; ++k)
                planes[k] = planeOf(first + k < m_faceCount ? first + k : first);
            CULLET_UNROLL
            for (std::uint32_t k = 0; k < kAtOnce; ++k)
            {
                if (first + k < m_faceCount &&
                    dot(planes[k].normal, point) - planes[k].distance > m_tolerance)
                    m_visible[count++] = {first + k, m_corners[first + k]};
            }
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
            const FaceCorners corners = m_visible[i].corners;
            const unsigned hidden = sharedEdges(visible, corners);
            CULLET_UNROLL
            for (std::uint32_t k = 0; k < 3; ++k)
            {
                if ((hidden >> k & 1u) != 0)
                    continue;
                start = corners[k];
                m_next[start] = static_cast<std::uint16_t>(corners[(k + 1) % 3]);
                ++edges;
            }
        }
        return edges;
    }

    /// Bit k: the edge from corner k to the next one is that of another visible face, too.
    CULLET_HOST_DEVICE unsigned sharedEdges(std::uint32_t visible, FaceCorners corners) const
    {
        const std::uint32_t back[3] = {FaceCorners::edge(corners[1], corners[0]),
                                       FaceCorners::edge(corners[2], corners[1]),
                                       FaceCorners::edge(corners[0], corners[2])};
        unsigned shared = 0;
        for (std::uint32_t i = 0; i < visible; ++i)
        {
            const FaceCorners other = m_visible[i].corners;
            CULLET_UNROLL
            for (unsigned k = 0; k < 3; ++k)
                shared |= other.hasEdge(back[k]) ? 1u << k : 0u;
        }
        return shared;
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
    CULLET_HOST_DEVICE bool setFan(std::uint32_t vertex, const Vec<double>& point, std::uint32_t start,
                                   std::uint32_t edges, std::uint32_t visible)
    {
        bool isSolid = true;
        std::uint32_t from = start;
        Vec<double> fromPoint = pointOf(from);
        for (std::uint32_t i = 0; i < edges; ++i)
        {
            const std::uint32_t to = m_next[from];
            const Vec<double> toPoint = pointOf(to);
            const std::uint32_t place = i < visible ? m_visible[i].face : m_faceCount++;
            isSolid = setFace(place, FaceCorners::of(from, to, vertex), fromPoint, toPoint, point) && isSolid;
            from = to;
            fromPoint = toPoint;
        }
        for (std::uint32_t i = visible; i > edges; --i)
            moveFace(--m_faceCount, m_visible[i - 1].face);
        return isSolid;
    }

    /// The point of a face where a ray from the origin meets its plane, clamped to the face.
    CULLET_HOST_DEVICE Foot footIn(std::uint32_t face, const Plane& closest) const
    {
        const FaceCorners corners = m_corners[face];
        Foot foot = {{corners[0], corners[1], corners[2]}, {1.0, 0.0, 0.0}, INFINITY};
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
        const Vec<double> points[3] = {a, b, c};
        for (int k = 0; k < 3; ++k)
        {
            foot.weights[k] /= sum;
            off = mulAdd(points[k], foot.weights[k], off);
        }
        foot.miss = rootOf(dot(off, off));
        return foot;
    }

    LaneArray<VectorXY> m_placesXY;
    LaneArray<PlaceZ> m_placesZ;
    LaneArray<VectorXY> m_normalsXY;
    LaneArray<double> m_normalsZ, m_distances;
    LaneArray<FaceCorners> m_corners;
    LaneArray<VisibleFace> m_visible;
    LaneArray<std::uint16_t> m_next;
    std::uint32_t m_capacity;
    std::uint32_t m_vertexCount = 0, m_faceCount = 0;
    double m_tolerance;
};
}  // namespace cullet::convex
