// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/box/box_axes.h"

#include <cmath>

namespace cullet
{
/// The two faces that meet in a contact, in the frame of the box that one of them belongs to: the reference.
///
/// A point is given by its coordinates x and y in the plane of the reference's face, onto which it slides along the
/// normal, and by its distance from there, which is negative inside of the reference. All three are linear functions.
template <class Vector>
class BoxFaces
{
public:
    using S = typename Vector::Scalar;

    /// The origin is the centre of the other box's face, the vectors lead to the middles of two of its edges.
    struct Function
    {
        S origin, u, v;
    };

    BoxFaces(const BoxPair<Vector>& pair, const BoxAxis<S>& axis)
        : m_isOfB(axis.faceOfB >= 0), m_slides(axis.edgeOfA >= 0)
    {
        m_isOfB ? makeFrameOfB(pair) : makeFrameOfA(pair);
        if (m_slides)
            setEdges(axis.edgeOfA, axis.edgeOfB);
        else
            setFace(m_isOfB ? axis.faceOfB : axis.faceOfA);
        setOtherFace();
    }

    /// Whether two edges cross far from level faces: the boxes then touch in one point, crossing().
    bool areEdgesOnly() const { return m_slides && (m_level < kLevel || m_otherLevel < kLevel); }

    /// The point of B's edge where the edges cross, in all lanes, in the frame of A.
    ///
    /// @param point [out] x, y and z
    /// @return the distance from the edge of A along the normal
    S crossing(Vector (&point)[3]) const
    {
        const int i = m_edgeOfA, j = m_edgeOfB;
        S fromA[3], onB[3];
        for (int r = 0; r < 3; ++r)
        {
            onB[r] = m_rows[r][3];
            for (int c = 0; c < 3; ++c)
                onB[r] -= c == j ? S(0) : std::copysign(m_otherHalf[c], m_along[c]) * m_rows[r][c];
            fromA[r] = onB[r] - (r == i ? S(0) : std::copysign(m_half[r], m_normal[r]));
        }
        // The closest point of B's edge; the product of the edges' directions is their cosine.
        const S cosine = m_rows[i][j];
        const S alongB = fromA[0] * m_rows[0][j] + fromA[1] * m_rows[1][j] + fromA[2] * m_rows[2][j];
        const S t = (cosine * fromA[i] - alongB) / (1 - cosine * cosine);
        const S onEdge = std::max(-m_otherHalf[j], std::min(m_otherHalf[j], t));
        for (int r = 0; r < 3; ++r)
            point[r] = Vector(onB[r] + onEdge * m_rows[r][j]);
        return fromA[0] * m_normal[0] + fromA[1] * m_normal[1] + fromA[2] * m_normal[2];
    }

    bool areInFrameOfB() const { return m_isOfB; }
    /// The unit normal from the reference to the other box, in the reference's frame.
    const S* normal() const { return m_normal; }
    S halfX() const { return m_half[next(m_face)]; }
    S halfY() const { return m_half[last(m_face)]; }
    const Function& x() const { return m_x; }
    const Function& y() const { return m_y; }
    const Function& distance() const { return m_distance; }

    /// The points on B, in the reference's frame.
    void pointsOnB(const Vector& x, const Vector& y, const Vector& distances, Vector (&points)[3]) const
    {
        const int k = m_face;
        points[next(k)] = x;
        points[last(k)] = y;
        points[k] = Vector(std::copysign(m_half[k], m_normal[k]));
        if (m_isOfB)
            return;
        points[k] = points[k] + distances * m_normal[k];
        if (!m_slides)
            return;
        points[next(k)] = points[next(k)] + distances * m_normal[next(k)];
        points[last(k)] = points[last(k)] + distances * m_normal[last(k)];
    }

private:
    /// Cosine of the angle between a normal and a face, eight degrees, up to which the face may support a contact.
    static constexpr S kLevel = S(0.99);

    static int next(int i) { return i == 2 ? 0 : i + 1; }
    static int last(int i) { return i == 0 ? 2 : i - 1; }

    void makeFrameOfA(const BoxPair<Vector>& pair)
    {
        for (int i = 0; i < 3; ++i)
            pair.rows[i].store(m_rows[i]);
        pair.halfA.store(m_half);
        pair.halfB.store(m_otherHalf);
    }

    void makeFrameOfB(const BoxPair<Vector>& pair)
    {
        Vector columns[4];
        transposeRows(pair.rows, columns);
        const Vector(&rows)[3] = pair.rows;
        const Vector centre = rows[0] * rows[0].template spread<3>() +
                              rows[1] * rows[1].template spread<3>() + rows[2] * rows[2].template spread<3>();
        for (int i = 0; i < 3; ++i)
        {
            columns[i].store(m_rows[i]);
            m_rows[i][3] = -centre[i];
        }
        pair.halfB.store(m_half);
        pair.halfA.store(m_otherHalf);
    }

    void setFace(int face)
    {
        m_face = face;
        m_normal[face] = m_rows[face][3] < 0 ? S(-1) : S(1);
        for (int j = 0; j < 3; ++j)
            m_along[j] = m_normal[face] * m_rows[face][j];
    }

    /// The face of A that the normal is closest to, among the two beside the edge.
    void setEdges(int edgeOfA, int edgeOfB)
    {
        const int k = next(edgeOfA), l = last(edgeOfA);
        const S onK = -m_rows[l][edgeOfB], onL = m_rows[k][edgeOfB];
        const S length = Vector::root(onK * onK + onL * onL);
        const S side = onK * m_rows[k][3] + onL * m_rows[l][3] < 0 ? S(-1) : S(1);
        m_normal[k] = side * onK / length;
        m_normal[l] = side * onL / length;
        m_face = std::abs(onK) >= std::abs(onL) ? k : l;
        for (int j = 0; j < 3; ++j)
            m_along[j] = m_normal[k] * m_rows[k][j] + m_normal[l] * m_rows[l][j];
        m_along[edgeOfB] = 0;
        m_edgeOfA = edgeOfA;
        m_edgeOfB = edgeOfB;
        m_level = std::abs(m_normal[m_face]);
    }

    void setOtherFace()
    {
        int face = std::abs(m_along[1]) > std::abs(m_along[0]) ? 1 : 0;
        face = std::abs(m_along[2]) > std::abs(m_along[face]) ? 2 : face;
        m_otherLevel = std::abs(m_along[face]);
        const S toFace = std::copysign(m_otherHalf[face], -m_along[face]);
        const int u = next(face), v = last(face);
        const auto coordinate = [&](int i, Function& f)
        {
            const S* const row = m_rows[i];
            f = {row[3] + toFace * row[face], m_otherHalf[u] * row[u], m_otherHalf[v] * row[v]};
        };
        coordinate(next(m_face), m_x);
        coordinate(last(m_face), m_y);
        coordinate(m_face, m_distance);
        const S side = std::copysign(S(1), m_normal[m_face]);
        Function& d = m_distance;
        d = {side * d.origin - m_half[m_face], side * d.u, side * d.v};
        if (m_slides)
            slide(m_normal[next(m_face)], m_normal[last(m_face)], std::abs(m_normal[m_face]));
    }

    void slide(S normalX, S normalY, S scale)
    {
        Function& d = m_distance;
        d = {d.origin / scale, d.u / scale, d.v / scale};
        m_x = {m_x.origin - normalX * d.origin, m_x.u - normalX * d.u, m_x.v - normalX * d.v};
        m_y = {m_y.origin - normalY * d.origin, m_y.u - normalY * d.u, m_y.v - normalY * d.v};
    }

    bool m_isOfB;
    bool m_slides;  ///< the normal is not that of the face
    int m_edgeOfA = -1, m_edgeOfB = -1;
    S m_level = 1, m_otherLevel;  ///< cosines of the normal and those of the faces
    int m_face = 0;               ///< axis of the reference's face
    S m_normal[3] = {0, 0, 0};
    S m_along[3];    ///< cosines of the normal and the other box's axes
    S m_rows[3][4];  ///< the other box in the reference's frame, as BoxPair::rows
    S m_half[4], m_otherHalf[4];
    Function m_x, m_y, m_distance;
};
}  // namespace cullet
