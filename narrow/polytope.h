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
    Polytope(const std::array<Eigen::Vector3d, 4>& tetrahedron, double size) : m_size(size)
    {
        std::copy(tetrahedron.begin(), tetrahedron.end(), m_vertices.begin());
        m_vertexCount = 4;
        const Eigen::Vector3d& d = tetrahedron[3];
        const double volume = (tetrahedron[0] - d).dot((tetrahedron[1] - d).cross(tetrahedron[2] - d));
        // Counter-clockwise from outside if the volume is positive, else with two corners swapped.
        const std::int16_t i = volume > 0.0 ? 0 : 1;
        const std::int16_t j = volume > 0.0 ? 1 : 0;
        addFace(i, j, 2);
        addFace(j, i, 3);
        addFace(2, j, 3);
        addFace(i, 2, 3);
    }

    bool isValid() const { return m_isValid; }

    const Face& closestFace() const
    {
        int best = 0;
        for (int i = 1; i < m_faceCount; ++i)
        {
            if (m_faces[i].distance < m_faces[best].distance)
                best = i;
        }
        return m_faces[best];
    }

    /// Adds a point outside of the surface.
    /// @return its index, or -1 if the polytope is full, the point sees no face, or the surface would break
    int add(const Eigen::Vector3d& point)
    {
        const int vertex = m_vertexCount;
        if (vertex == kMaxVertices || !collectHorizon(point))
            return -1;
        m_vertices[m_vertexCount++] = point;
        int kept = 0;
        for (int i = 0; i < m_faceCount; ++i)
        {
            if (m_isVisible[i])
                continue;
            if (kept != i)
                m_faces[kept] = m_faces[i];
            ++kept;
        }
        m_faceCount = kept;
        for (int i = 0; i < m_edgeCount && m_isValid; ++i)
            addFace(m_edges[i][0], m_edges[i][1], static_cast<std::int16_t>(vertex));
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
    void addFace(std::int16_t i, std::int16_t j, std::int16_t k)
    {
        const Eigen::Vector3d ij = m_vertices[j] - m_vertices[i];
        const Eigen::Vector3d ik = m_vertices[k] - m_vertices[i];
        const Eigen::Vector3d scaled = ij.cross(ik);
        const double length = scaled.norm();
        // 1e-12: a relative height below which the direction of the normal is mostly rounding.
        if (m_faceCount == kMaxFaces || !(length > 1e-12 * ij.norm() * ik.norm()))
        {
            m_isValid = false;
            return;
        }
        const Eigen::Vector3d normal = scaled / length;
        m_faces[m_faceCount++] = {normal, normal.dot(m_vertices[i]), {i, j, k}};
    }

    /// The edges between faces that the point sees and others; they must form one closed walk.
    bool collectHorizon(const Eigen::Vector3d& point)
    {
        m_edgeCount = 0;
        for (int i = 0; i < m_faceCount; ++i)
        {
            const Face& face = m_faces[i];
            m_isVisible[i] = face.normal.dot(point) - face.distance > 1e-13 * m_size;
            if (!m_isVisible[i])
                continue;
            for (int k = 0; k < 3; ++k)
            {
                if (!toggleEdge(face.vertex[k], face.vertex[(k + 1) % 3]))
                    return false;
            }
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
        next.fill(-1);
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
    std::array<Face, kMaxFaces> m_faces;
    std::array<bool, kMaxFaces> m_isVisible;
    std::array<std::array<std::int16_t, 2>, 3 * kMaxVertices> m_edges;
    double m_size;
    int m_vertexCount = 0;
    int m_faceCount = 0;
    int m_edgeCount = 0;
    bool m_isValid = true;
};
}  // namespace cullet
