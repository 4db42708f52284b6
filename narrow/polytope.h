// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace cullet
{
/// Convex polytope around the origin that grows by points: the state of the expanding polytope algorithm.
///
/// Fixed capacity on the stack: no allocation. add() refuses what would break the surface, and the caller has to find
/// its answer in another way.
class Polytope
{
public:
    static constexpr int kMaxVertices = 132;
    static constexpr int kMaxFaces = 2 * kMaxVertices;

    struct Face
    {
        Eigen::Vector3d normal;  ///< unit, outward
        double distance;         ///< of its plane from the origin; at least 0 up to rounding
        std::array<std::int16_t, 3> vertex;
    };

    /// @param tetrahedron four points that are not coplanar, around the origin
    /// @param size        unit of the tolerances
    Polytope(const std::array<Eigen::Vector3d, 4>& tetrahedron, double size) : m_tolerance(1e-13 * size)
    {
        std::copy(tetrahedron.begin(), tetrahedron.end(), m_vertices.begin());
        m_vertexCount = 4;
        m_faceCount = 4;
        const Eigen::Vector3d& d = tetrahedron[3];
        const double volume = (tetrahedron[0] - d).dot((tetrahedron[1] - d).cross(tetrahedron[2] - d));
        // Counter-clockwise from outside if the volume is positive, else with two corners swapped.
        const std::int16_t i = volume > 0.0 ? 0 : 1;
        const std::int16_t j = volume > 0.0 ? 1 : 0;
        setFace(0, i, j, 2);
        setFace(1, j, i, 3);
        setFace(2, 2, j, 3);
        setFace(3, i, 2, 3);
    }

    bool isValid() const { return m_isValid; }

    Face closestFace() const
    {
        int best = 0;
        for (int i = 1; i < m_faceCount; ++i)
            best = m_squares[i] < m_squares[best] ? i : best;
        const Eigen::Vector3d scaled(m_x[best], m_y[best], m_z[best]);
        const Eigen::Vector3d normal = scaled / scaled.norm();
        return {normal, normal.dot(m_vertices[m_corners[best][0]]), m_corners[best]};
    }

    /// Adds a point outside of the surface.
    /// @return its index, or -1 if the polytope is full, the point sees no face, or the surface would break
    int add(const Eigen::Vector3d& point)
    {
        const int vertex = m_vertexCount;
        if (vertex == kMaxVertices || !collectHorizon(point))
            return -1;
        m_vertices[m_vertexCount++] = point;
        // New faces take the places of those that the point sees; then the last ones fill what is left of these.
        for (int i = 0; i < m_edgeCount && m_isValid; ++i)
        {
            const int place = i < m_visibleCount ? m_visible[i] : m_faceCount++;
            m_isValid = m_isValid && place < kMaxFaces;
            if (m_isValid)
                setFace(place, m_edges[i][0], m_edges[i][1], static_cast<std::int16_t>(vertex));
        }
        for (int i = m_visibleCount - 1; i >= m_edgeCount; --i)
            moveFace(--m_faceCount, m_visible[i]);
        return m_isValid ? vertex : -1;
    }

    /// Weights of the corners at the foot of the origin on the face, not negative.
    Eigen::Vector3d weights(const Face& face) const
    {
        const Eigen::Vector3d& a = m_vertices[face.vertex[0]];
        const Eigen::Vector3d& b = m_vertices[face.vertex[1]];
        const Eigen::Vector3d& c = m_vertices[face.vertex[2]];
        Eigen::Vector3d w(face.normal.dot(b.cross(c)), face.normal.dot(c.cross(a)),
                          face.normal.dot(a.cross(b)));
        w = w.cwiseMax(0.0);
        const double sum = w.sum();
        return sum > 0.0 ? Eigen::Vector3d(w / sum) : Eigen::Vector3d::Constant(1.0 / 3.0);
    }

private:
    /// Normals stay as long as twice the area of their face: one root and one division for each face instead of six.
    void setFace(int place, std::int16_t i, std::int16_t j, std::int16_t k)
    {
        const Eigen::Vector3d ij = m_vertices[j] - m_vertices[i];
        const Eigen::Vector3d ik = m_vertices[k] - m_vertices[i];
        const Eigen::Vector3d normal = ij.cross(ik);
        const double square = normal.squaredNorm();
        // 1e-12: a relative height below which the direction of the normal is mostly rounding.
        if (!(square > 1e-24 * ij.squaredNorm() * ik.squaredNorm()))
        {
            m_isValid = false;
            return;
        }
        const double offset = normal.dot(m_vertices[i]);
        m_x[place] = normal.x();
        m_y[place] = normal.y();
        m_z[place] = normal.z();
        m_limits[place] = offset + m_tolerance * std::sqrt(square);
        m_squares[place] = offset * std::abs(offset) / square;
        m_corners[place] = {i, j, k};
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

    /// The edges between faces that the point sees and others; they must form one closed walk.
    bool collectHorizon(const Eigen::Vector3d& point)
    {
        const double x = point.x(), y = point.y(), z = point.z();
        std::array<double, kMaxFaces> heights;
        for (int i = 0; i < m_faceCount; ++i)
            heights[i] = m_x[i] * x + m_y[i] * y + m_z[i] * z - m_limits[i];
        m_visibleCount = 0;
        for (int i = 0; i < m_faceCount; ++i)
        {
            m_visible[m_visibleCount] = static_cast<std::int16_t>(i);
            m_visibleCount += heights[i] > 0.0 ? 1 : 0;
        }
        m_edgeCount = 0;
        for (int i = 0; i < m_visibleCount; ++i)
        {
            const std::array<std::int16_t, 3>& corners = m_corners[m_visible[i]];
            if (!toggleEdge(corners[0], corners[1]) || !toggleEdge(corners[1], corners[2]) ||
                !toggleEdge(corners[2], corners[0]))
                return false;
        }
        return isOneWalk();
    }

    /// An edge whose other side is visible too is no horizon.
    bool toggleEdge(std::int16_t from, std::int16_t to)
    {
        for (int i = 0; i < m_edgeCount; ++i)
        {
            if (m_edges[i][0] == to && m_edges[i][1] == from)
            {
                m_edges[i] = m_edges[--m_edgeCount];
                return true;
            }
        }
        if (m_edgeCount == static_cast<int>(m_edges.size()))
            return false;
        m_edges[m_edgeCount++] = {from, to};
        return true;
    }

    bool isOneWalk() const
    {
        std::array<std::int16_t, kMaxVertices> next;
        std::fill_n(next.begin(), m_vertexCount, std::int16_t(-1));
        for (int i = 0; i < m_edgeCount; ++i)
        {
            if (next[m_edges[i][0]] >= 0)
                return false;
            next[m_edges[i][0]] = m_edges[i][1];
        }
        if (m_edgeCount < 3)
            return false;
        int length = 0;
        std::int16_t vertex = m_edges[0][0];
        do
        {
            vertex = next[vertex];
            ++length;
        } while (vertex >= 0 && vertex != m_edges[0][0] && length <= m_edgeCount);
        return vertex >= 0 && length == m_edgeCount;
    }

    std::array<Eigen::Vector3d, kMaxVertices> m_vertices;
    // By face: its normal, the product with the normal above which a point sees it, and its squared distance from the
    // origin with the sign of the distance.
    std::array<double, kMaxFaces> m_x, m_y, m_z, m_limits, m_squares;
    std::array<std::array<std::int16_t, 3>, kMaxFaces> m_corners;
    std::array<std::int16_t, kMaxFaces + 1> m_visible;
    std::array<std::array<std::int16_t, 2>, 3 * kMaxVertices> m_edges;
    double m_tolerance;
    int m_vertexCount = 0;
    int m_faceCount = 0;
    int m_visibleCount = 0;
    int m_edgeCount = 0;
    bool m_isValid = true;
};
}  // namespace cullet
