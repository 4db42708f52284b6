// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/epa/polytope_parts.h"
#include "cullet/narrow/math/lanes.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace cullet
{
/// Closed surface of triangles around the origin that grows by points: the state of the expanding polytope algorithm.
///
/// Convex if it has grown from a tetrahedron. Fixed capacity: no allocation. add() refuses a point that would break the
/// surface; the caller then needs another algorithm.
///
/// @tparam Capacity most vertices; a multiple of 64
template <int Capacity>
class BasicPolytope : public PolytopeParts
{
public:
    static constexpr int kMaxVertices = Capacity;
    static constexpr int kMaxFaces = 2 * kMaxVertices;

    /// A polytope without points.
    ///
    /// @param size unit of the tolerances
    explicit BasicPolytope(double size) : m_tolerance(1e-13 * size) {}

    /// Starts from four points that are not coplanar, with the origin inside.
    void setTetrahedron(const std::array<Eigen::Vector3d, 4>& tetrahedron)
    {
        for (const Eigen::Vector3d& point : tetrahedron)
            addVertex(point);
        const Eigen::Vector3d& d = tetrahedron[3];
        const double volume = (tetrahedron[0] - d).dot((tetrahedron[1] - d).cross(tetrahedron[2] - d));
        // Counter-clockwise from outside if the volume is positive, else with two corners swapped.
        const std::int16_t i = volume > 0.0 ? 0 : 1;
        const std::int16_t j = volume > 0.0 ? 1 : 0;
        addFaces({{{i, j, 2}, {j, i, 3}}}, 2);
        addFaces({{{2, j, 3}, {i, 2, 3}}}, 2);
    }

    /// Adds a vertex for faces that are added later.
    void addVertex(const Eigen::Vector3d& point) { m_vertices[m_vertexCount++] = point; }

    using TwoFaces = std::array<Corners, 2>;

    /// @param faces counter-clockwise from outside; the caller guarantees that the faces close the surface
    /// @param count 1 or 2; with 1 the second face is ignored
    void addFaces(const TwoFaces& faces, int count)
    {
        setFaces(m_faceCount, faces);
        m_faceCount += count;
    }

    bool isValid() const { return m_isValid; }
    /// The capacity alone keeps the polytope from growing.
    bool isFull() const { return m_isValid && m_vertexCount == kMaxVertices; }
    int vertexCount() const { return m_vertexCount; }
    int faceCount() const { return m_faceCount; }
    const Corners& corners(int face) const { return m_corners[face]; }

    Face closestFace()
    {
        const int best = closest();
        const Eigen::Vector3d scaled(m_x[best], m_y[best], m_z[best]);
        const double length = squareRoot(scaled.squaredNorm());
        return {scaled, length, scaled.dot(m_vertices[m_corners[best][0]]) / length, m_corners[best], best};
    }

    /// Whether all faces up to a distance lie in the plane of the closest face; one that faces the other way does not.
    bool isOnlyClosestPlane(const Face& face, double distance) const
    {
        constexpr double kParallel2 = 1e-20;
        for (int i = 0; i < m_faceCount; ++i)
        {
            if (m_squares[i] > distance * distance)
                continue;
            const Eigen::Vector3d normal(m_x[i], m_y[i], m_z[i]);
            // A NaN makes the comparison false.
            if (!(face.scaledNormal.dot(normal) > 0.0) ||
                !(face.scaledNormal.cross(normal).squaredNorm() <=
                  kParallel2 * face.length * face.length * normal.squaredNorm()))
                return false;
        }
        return true;
    }

    /// Adds a point outside of the surface.
    /// @return its index, or -1 if the polytope is full, no face is visible from the point, or the surface breaks or is
    /// broken
    int add(const Eigen::Vector3d& point)
    {
        const int vertex = m_vertexCount;
        if (!m_isValid || vertex == kMaxVertices || !collectHorizon(point))
            return -1;
        addVertex(point);
        m_isValid = m_faceCount + m_horizonCount - m_visibleCount <= kMaxFaces && setFan(point, vertex);
        return m_isValid ? vertex : -1;
    }

    /// Repairs a dent by an edge flip: the edge shared with the neighbour that rises most above the face is replaced by
    /// the one that joins the other two corners of both. The surface stays closed.
    ///
    /// @return false if no neighbour rises, or not both new faces would be farther from the origin than the old face
    bool lift(const Face& face)
    {
        const Neighbour risen = highestNeighbour(face);
        const int scratch = m_faceCount;
        if (risen.face < 0 || scratch + 2 > kMaxFaces || isEdge(face.vertex[risen.apex], risen.far))
            return false;
        const auto corner = [&](int i)
        { return face.vertex[static_cast<std::size_t>((risen.apex + i) % 3)]; };
        setFaces(scratch, {{{corner(0), corner(1), risen.far}, {corner(0), risen.far, corner(2)}}});
        const double least = std::min(m_squares[scratch], m_squares[scratch + 1]);
        const bool isLifted = m_isValid && least > m_squares[face.index];
        m_isValid = true;
        if (!isLifted)
            return false;
        moveFace(scratch, face.index);
        moveFace(scratch + 1, risen.face);
        return true;
    }

    /// Removes a vertex and closes the hole with a fan, if no new face is closer to the origin than the root of
    /// `square`. The surface stays closed and around the origin; it need not stay convex.
    bool removeVertex(std::int16_t vertex, double square)
    {
        m_visibleCount = 0;
        for (int i = 0; i < m_faceCount; ++i)
        {
            const Corners& c = m_corners[i];
            m_visible[m_visibleCount] = static_cast<std::int16_t>(i);
            m_visibleCount += hasCorner(c, vertex) ? 1 : 0;
        }
        std::int16_t apex = 0;
        for (int i = 0; i < m_visibleCount; ++i)
        {
            const Corners& c = m_corners[m_visible[i]];
            const int at = c[0] == vertex ? 0 : c[1] == vertex ? 1 : 2;
            apex = c[(at + 1) % 3];
            m_next[apex] = c[(at + 2) % 3];
        }
        for (int attempt = 0; attempt < m_visibleCount; ++attempt, apex = m_next[apex])
        {
            if (closeWithFan(apex, square))
                return true;
        }
        return false;
    }

    /// Where the ray from the origin along the normal of the closest face leaves the surface. That may be in another
    /// face: of several in one plane, as a pair of edges makes them, rounding decides which is the closest. Of all
    /// candidate faces, the one whose point is nearest to the foot on the plane is returned: a face parallel to the ray
    /// also has weights, which are mostly rounding.
    ///
    /// @param slack bounds how much farther away the surface is there than the plane of the face
    Foot footOf(const Face& face, double slack) const
    {
        Foot best = footIn(face.vertex, face);
        const double reach = (face.distance + slack) * (1.0 + 1e-9) + m_tolerance;
        for (int i = 0; !(best.miss <= kNoMiss * m_tolerance) && i < m_faceCount; ++i)
        {
            if (m_squares[i] > reach * reach)
                continue;
            const Foot foot = footIn(m_corners[i], face);
            // A NaN makes the comparison false.
            if (foot.miss < best.miss)
                best = foot;
        }
        return best;
    }

private:
    /// A face whose squared sine is below this is too thin: its normal is mostly rounding.
    static constexpr double kThinnest = 1e-24;
    /// A foot within this, times the tolerance of planes, is the right one up to rounding.
    static constexpr double kNoMiss = 1e3;

    /// The point of a face where the ray along the normal of the closest face meets its plane, clamped to the face.
    Foot footIn(const Corners& vertex, const Face& closest) const
    {
        const Eigen::Vector3d& a = m_vertices[vertex[0]];
        const Eigen::Vector3d& b = m_vertices[vertex[1]];
        const Eigen::Vector3d& c = m_vertices[vertex[2]];
        const Eigen::Vector3d& ray = closest.scaledNormal;
        const Eigen::Vector3d w(ray.dot(b.cross(c)), ray.dot(c.cross(a)), ray.dot(a.cross(b)));
        // The ray does not leave through a face that it enters by.
        if (!(w.sum() > 0.0))
            return {vertex, Eigen::Vector3d::Constant(1.0 / 3.0), std::numeric_limits<double>::infinity()};
        const Eigen::Vector3d inside = w.cwiseMax(0.0);
        const Eigen::Vector3d weights = inside / inside.sum();
        const Eigen::Vector3d point = weights[0] * a + weights[1] * b + weights[2] * c;
        return {vertex, weights, (point - (closest.distance / closest.length) * ray).norm()};
    }

    struct Neighbour
    {
        int face = -1;
        int apex = 0;          ///< corner of the given face that the neighbour lacks
        std::int16_t far = 0;  ///< corner of the neighbour that the given face lacks
    };

    /// Of the faces that share an edge with a face, the one whose third corner is the highest above its plane.
    Neighbour highestNeighbour(const Face& face) const
    {
        // The marks of two corners have a different sum for each edge.
        std::array<std::uint8_t, kMaxVertices> marks;
        std::fill_n(marks.begin(), m_vertexCount, std::uint8_t(0));
        for (int k = 0; k < 3; ++k)
            marks[face.vertex[k]] = static_cast<std::uint8_t>(1 << k);
        Neighbour highest;
        double height = m_limits[face.index];
        for (int i = 0; i < m_faceCount; ++i)
        {
            const Corners& c = m_corners[i];
            const int shared = marks[c[0]] + marks[c[1]] + marks[c[2]];
            if (shared != 3 && shared != 5 && shared != 6)
                continue;
            const std::int16_t far = marks[c[0]] == 0 ? c[0] : marks[c[1]] == 0 ? c[1] : c[2];
            if (const double h = face.scaledNormal.dot(m_vertices[far]); h > height)
            {
                height = h;
                highest = {i, shared == 3 ? 2 : shared == 5 ? 1 : 0, far};
            }
        }
        return highest;
    }

    bool isEdge(std::int16_t one, std::int16_t other) const
    {
        for (int i = 0; i < m_faceCount; ++i)
        {
            if (hasCorner(m_corners[i], one) && hasCorner(m_corners[i], other))
                return true;
        }
        return false;
    }

    using Row = std::array<double, kMaxFaces + 4>;
    static constexpr int kRing = kMaxVertices + 2;

    /// The face with the smallest squared distance, in four lanes and without a branch.
    int closest()
    {
        for (int i = m_faceCount; i % (2 * L::kWidth) != 0; ++i)
            m_squares[i] = std::numeric_limits<double>::infinity();
        L::Vector low0 = L::load(&m_squares[0]), low1 = L::load(&m_squares[L::kWidth]);
        L::Mask where0 = L::counting(), where1 = where0 + L::kWidth;
        L::Mask index0 = where0, index1 = where1;
        for (int i = 2 * L::kWidth; i < m_faceCount; i += 2 * L::kWidth)
        {
            const L::Vector s0 = L::load(&m_squares[i]), s1 = L::load(&m_squares[i + L::kWidth]);
            index0 += 2 * L::kWidth;
            index1 += 2 * L::kWidth;
            where0 = s0 < low0 ? index0 : where0;
            where1 = s1 < low1 ? index1 : where1;
            low0 = s0 < low0 ? s0 : low0;
            low1 = s1 < low1 ? s1 : low1;
        }
        where0 = low1 < low0 ? where1 : where0;
        low0 = low1 < low0 ? low1 : low0;
        return static_cast<int>(low0[1] < low0[0] ? where0[1] : where0[0]);
    }

    using L = Lanes<double>;
    static_assert(L::kWidth == 2);

    /// One point of each of two faces, by lane.
    struct TwoPoints
    {
        L::Vector x, y, z;

        L::Vector dot(const TwoPoints& o) const { return x * o.x + y * o.y + z * o.z; }
        TwoPoints operator-(const TwoPoints& o) const { return {x - o.x, y - o.y, z - o.z}; }
        TwoPoints cross(const TwoPoints& o) const
        {
            return {y * o.z - z * o.y, z * o.x - x * o.z, x * o.y - y * o.x};
        }
    };

    TwoPoints cornersOf(const TwoFaces& faces, std::size_t corner) const
    {
        const Eigen::Vector3d& p = m_vertices[faces[0][corner]];
        const Eigen::Vector3d& q = m_vertices[faces[1][corner]];
        return {L::Vector{p.x(), q.x()}, L::Vector{p.y(), q.y()}, L::Vector{p.z(), q.z()}};
    }

    /// Stores two faces at an index and the next one.
    void setFaces(int place, const TwoFaces& faces)
    {
        const TwoPoints first = cornersOf(faces, 0);
        const TwoPoints ij = cornersOf(faces, 1) - first;
        const TwoPoints ik = cornersOf(faces, 2) - first;
        m_isValid = setPlanes(ij, ik, first, {place, place + 1}) && m_isValid;
        m_corners[place] = faces[0];
        m_corners[place + 1] = faces[1];
    }

    /// Computes the planes of two faces. Normals keep a length of twice the area of their face: one division per face
    /// instead of a root and four divisions.
    ///
    /// @return false if a face is too thin
    [[gnu::always_inline]] bool setPlanes(const TwoPoints& ij, const TwoPoints& ik, const TwoPoints& corner,
                                          const std::array<int, 2>& places)
    {
        const TwoPoints normal = ij.cross(ik);
        const L::Vector square = normal.dot(normal);
        const L::Vector offset = normal.dot(corner);
        // The 1-norm replaces the length, which would need a root: at most 1.8 times as much.
        const L::Vector limit =
            offset + m_tolerance * (L::magnitude(normal.x) + L::magnitude(normal.y) + L::magnitude(normal.z));
        const L::Vector distance2 = offset * L::magnitude(offset) / L::withoutZeros(square);
        for (int i = 0; i < 2; ++i)
        {
            const int place = places[static_cast<std::size_t>(i)];
            m_x[place] = normal.x[i];
            m_y[place] = normal.y[i];
            m_z[place] = normal.z[i];
            m_limits[place] = limit[i];
            m_squares[place] = distance2[i];
        }
        return laneBits(square > kThinnest * (ij.dot(ij) * ik.dot(ik))) == 3;
    }

    void moveFace(int from, int to)
    {
        m_x[to] = m_x[from];
        m_y[to] = m_y[from];
        m_z[to] = m_z[from];
        m_limits[to] = m_limits[from];
        m_squares[to] = m_squares[from];
        m_corners[to] = m_corners[from];
    }

    /// Adds a face between the new vertex and each edge of the horizon: at the indices of the visible faces, then at
    /// the end. If there are fewer new faces, the last faces fill the free indices.
    ///
    /// @return false if a face is too thin
    bool setFan(const Eigen::Vector3d& point, int vertex)
    {
        const int count = m_horizonCount;
        double* const x = m_scratch.data();
        double* const y = x + kRing;
        double* const z = y + kRing;
        for (int i = 0; i < count; ++i)
        {
            const Eigen::Vector3d& v = m_vertices[m_horizon[i]];
            x[i] = v.x() - point.x();
            y[i] = v.y() - point.y();
            z[i] = v.z() - point.z();
        }
        for (int i = 0; i < 2; ++i)
        {
            x[count + i] = x[i];
            y[count + i] = y[i];
            z[count + i] = z[i];
            m_horizon[count + i] = m_horizon[i];
        }
        const TwoPoints apex = {L::fill(point.x()), L::fill(point.y()), L::fill(point.z())};
        const auto load = [&](int i) { return TwoPoints{L::load(&x[i]), L::load(&y[i]), L::load(&z[i])}; };
        const auto placeOf = [&](int i) { return i < m_visibleCount ? m_visible[i] : m_faceCount++; };
        bool isSolid = true;
        for (int i = 0; i < count; i += 2)
        {
            const int first = placeOf(i);
            const int second = i + 1 < count ? placeOf(i + 1) : kMaxFaces + 3;
            isSolid = setPlanes(load(i), load(i + 1), apex, {first, second}) && isSolid;
            m_corners[first] = {m_horizon[i], m_horizon[i + 1], static_cast<std::int16_t>(vertex)};
            m_corners[second] = {m_horizon[i + 1], m_horizon[i + 2], static_cast<std::int16_t>(vertex)};
        }
        for (int i = m_visibleCount - 1; i >= count; --i)
            moveFace(--m_faceCount, m_visible[i]);
        return isSolid;
    }

    /// Replaces the visible faces by a fan over their outline m_next; two faces fewer.
    bool closeWithFan(std::int16_t apex, double square)
    {
        const int count = m_visibleCount - 2;
        const int scratch = m_faceCount;
        if (count < 1 || scratch + count > kMaxFaces)
            return false;
        std::int16_t corner = m_next[apex];
        for (int i = 0; i < count; i += 2)
        {
            const std::int16_t next = m_next[corner], last = m_next[next];
            const int second = i + 1 < count ? 1 : 0;
            const TwoFaces faces = {{{apex, corner, next}, {apex, next, last}}};
            setFaces(scratch + i, {{faces[0], faces[static_cast<std::size_t>(second)]}});
            // A NaN makes the comparison false.
            const bool areFar = m_squares[scratch + i] >= square && m_squares[scratch + i + 1] >= square;
            if (!m_isValid || !areFar)
            {
                m_isValid = true;
                return false;
            }
            corner = last;
        }
        for (int i = 0; i < count; ++i)
            moveFace(scratch + i, m_visible[i]);
        for (int i = m_visibleCount - 1; i >= count; --i)
            moveFace(--m_faceCount, m_visible[i]);
        return true;
    }

    void collectVisible(const Eigen::Vector3d& point)
    {
        const double x = point.x(), y = point.y(), z = point.z();
        double* const heights = m_scratch.data();
        for (int i = 0; i < m_faceCount; ++i)
            heights[i] = m_x[i] * x + m_y[i] * y + m_z[i] * z - m_limits[i];
        m_visibleCount = 0;
        for (int i = 0; i < m_faceCount; ++i)
        {
            m_visible[m_visibleCount] = static_cast<std::int16_t>(i);
            m_visibleCount += heights[i] > 0.0 ? 1 : 0;
        }
    }

    /// Collects the horizon: the closed walk of edges between faces visible from the point and others. @return false
    /// unless there is one
    bool collectHorizon(const Eigen::Vector3d& point)
    {
        collectVisible(point);
        for (int i = 0; i < m_visibleCount; ++i)
        {
            for (const std::int16_t corner : m_corners[m_visible[i]])
                m_ends[corner].fill(0);
        }
        for (int i = 0; i < m_visibleCount; ++i)
        {
            const Corners& c = m_corners[m_visible[i]];
            for (int k = 0; k < 3; ++k)
                m_ends[c[k]][c[(k + 1) % 3] >> 6] |= std::uint64_t(1) << (c[(k + 1) % 3] & 63);
        }
        // An edge between two visible faces is not on the horizon.
        int edgeCount = 0;
        std::int16_t start = 0;
        for (int i = 0; i < m_visibleCount; ++i)
        {
            const Corners& c = m_corners[m_visible[i]];
            for (int k = 0; k < 3; ++k)
            {
                const std::int16_t from = c[k], to = c[(k + 1) % 3];
                // Without a branch, since about every second edge is on the horizon.
                const bool isHorizon = (m_ends[to][from >> 6] >> (from & 63) & 1) == 0;
                m_next[from] = isHorizon ? to : m_next[from];
                start = isHorizon ? from : start;
                edgeCount += isHorizon ? 1 : 0;
            }
        }
        return edgeCount >= 3 && walkHorizon(start, edgeCount);
    }

    /// @return false unless all edges form one closed walk, in which each vertex has one outgoing edge
    bool walkHorizon(std::int16_t start, int edgeCount)
    {
        m_horizonCount = 0;
        std::int16_t vertex = start;
        do
        {
            m_horizon[m_horizonCount++] = vertex;
            vertex = m_next[vertex];
        } while (vertex != start && m_horizonCount < edgeCount);
        return vertex == start && m_horizonCount == edgeCount;
    }

    std::array<Eigen::Vector3d, kMaxVertices> m_vertices;
    // By face: its normal, the product with the normal above which the face is visible from a point, and its squared
    // distance from the origin with the sign of the distance.
    Row m_x, m_y, m_z, m_limits, m_squares;
    std::array<Corners, kMaxFaces + 4> m_corners;
    std::array<std::int16_t, kMaxFaces + 4> m_visible;
    std::array<std::int16_t, kMaxVertices + 2> m_horizon;  ///< vertices in the order of the closed walk
    std::array<std::int16_t, kMaxVertices> m_next;         ///< by vertex: the next one on the walk
    /// By vertex: a bit for every vertex to which an edge of a visible face leads.
    std::array<std::array<std::uint64_t, kMaxVertices / 64>, kMaxVertices> m_ends;
    /// Heights over all faces, or coordinates of a horizon, valid within one call; a member, so that a polytope on the
    /// heap has them there, too.
    std::array<double, 3 * kRing> m_scratch;
    double m_tolerance;
    int m_vertexCount = 0;
    int m_faceCount = 0;
    int m_visibleCount = 0;
    int m_horizonCount = 0;
    bool m_isValid = true;
};

/// Small enough for the stack; large enough for the Minkowski differences of most shapes.
using Polytope = BasicPolytope<128>;
}  // namespace cullet
