// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/box/box_faces.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cullet
{
/// The corners of the polygon in which the two faces of a contact overlap, those where the boxes overlap: the ends of the
/// parts of the other face's edges that are over the reference's face, and corners of that. Four are found at a time, with
/// an edge or a corner in each lane.
///
/// What touches the rim up to rounding is inside, so that no corner of the polygon is missed, and one may be found twice.
template <class Vector>
class BoxCorners
{
public:
    using S = typename Vector::Scalar;
    using Function = typename BoxFaces<Vector>::Function;
    static constexpr int kGroups = 3;  ///< of four corners

    explicit BoxCorners(const BoxFaces<Vector>& faces) : m_faces(faces)
    {
        const Function &x = faces.x(), &y = faces.y();
        const S own = faces.halfX() + faces.halfY();
        const S other = std::abs(x.u) + std::abs(x.v) + std::abs(y.u) + std::abs(y.v);
        m_noise = 8 * std::numeric_limits<S>::epsilon() * (own + std::abs(x.origin) + std::abs(y.origin));
        m_apart = std::max(m_noise, kApart * std::min(own, other));
    }

    const Vector (&x() const)[kGroups] { return m_x; }
    const Vector (&y() const)[kGroups] { return m_y; }
    const Vector (&distances() const)[kGroups] { return m_distances; }
    /// Lanes of a comparison: the corner is there.
    const Vector (&areThere() const)[kGroups] { return m_areThere; }
    /// Bit i: corner i is there.
    unsigned there() const
    {
        return m_areThere[0].bits() | m_areThere[1].bits() << 4 | m_areThere[2].bits() << 8;
    }
    /// Bit i: corner i is a corner of the other face.
    unsigned whole() const { return m_whole; }
    /// A thousandth of the smaller face's size. Corners that are closer are one.
    S apart() const { return m_apart; }

    /// @return whether the corners of the other face, in the first group, are all of the contact's corners
    bool findOther()
    {
        m_x[0] = corners(m_faces.x());
        m_y[0] = corners(m_faces.y());
        m_distances[0] = corners(m_faces.distance());
        const Vector isIn = isWithin(m_x[0], m_faces.halfX() + m_noise) &
                            isWithin(m_y[0], m_faces.halfY() + m_noise) & (m_distances[0] <= Vector(S(0)));
        return isIn.bits() == 15 && areEdgesLong();
    }

    /// Call after findOther().
    ///
    /// @return false if rounding leaves no corner
    bool findAll()
    {
        addCornersOfReference();
        addEdges();
        return ((m_areThere[0] | m_areThere[1]) | m_areThere[2]).bits() != 0;
    }

    /// Makes the deepest corner of the other face, moved onto the reference's, the only one.
    ///
    /// @param depth its distance
    void takeDeepest(S depth)
    {
        const Vector x = corners(m_faces.x()), y = corners(m_faces.y()), d = corners(m_faces.distance());
        int deepest = 0;
        for (int i = 1; i < 4; ++i)
            deepest = d[i] < d[deepest] ? i : deepest;
        set(0, Vector(std::clamp(x[deepest], -m_faces.halfX(), m_faces.halfX())),
            Vector(std::clamp(y[deepest], -m_faces.halfY(), m_faces.halfY())), Vector(depth), x == x);
    }

private:
    static constexpr S kApart = S(1) / 1024;

    /// The signs of u and v in the corners of the other face, one after the other.
    static Vector signsOfU() { return {1, -1, -1, 1}; }
    static Vector signsOfV() { return {1, 1, -1, -1}; }

    static Vector corners(const Function& f) { return signsOfU() * f.u + signsOfV() * f.v + f.origin; }

    static Vector isWithin(const Vector& v, S limit) { return v.magnitude() <= Vector(limit); }

    bool areEdgesLong() const
    {
        const Function &x = m_faces.x(), &y = m_faces.y();
        return std::min(x.u * x.u + y.u * y.u, x.v * x.v + y.v * y.v) > m_apart * m_apart;
    }

    void set(int group, const Vector& x, const Vector& y, const Vector& distances, const Vector& areCorners)
    {
        m_x[group] = x;
        m_y[group] = y;
        m_distances[group] = distances;
        m_areThere[group] = areCorners & (distances <= Vector(S(0)));
    }

    void addCornersOfReference()
    {
        const Function &fx = m_faces.x(), &fy = m_faces.y(), &fd = m_faces.distance();
        const S area = fx.u * fy.v - fx.v * fy.u;
        const Vector x = signsOfU() * m_faces.halfX(), y = signsOfV() * m_faces.halfY();
        const Vector dx = x - fx.origin, dy = y - fy.origin;
        const Vector alongU = dx * fy.v - dy * fx.v, alongV = dy * fx.u - dx * fy.u;
        const Vector isIn = isWithin(alongU, std::abs(area) + m_noise * (std::abs(fx.v) + std::abs(fy.v))) &
                            isWithin(alongV, std::abs(area) + m_noise * (std::abs(fx.u) + std::abs(fy.u)));
        // A face without area has no point beside its edges.
        const S slope = area != 0 ? 1 / area : S(0);
        const Vector isFace = Vector(std::abs(area)) > Vector(S(0));
        set(1, x, y, (alongU * fd.u + alongV * fd.v) * slope + fd.origin, isIn & isFace);
    }

    /// The lines x = limit and x = -limit cut a part out of each edge.
    ///
    /// @param first, last [in, out] ends of the part that is left, as fractions of the edge
    void cut(const Vector& x, const Vector& along, S limit, Vector& first, Vector& last) const
    {
        // Parallel edges are cut far outside, or nothing is left of them.
        const Vector isParallel = along == Vector(S(0));
        const S tiny = std::max(std::numeric_limits<S>::min(), m_noise / 1024);
        const Vector slope = along + (isParallel & Vector(tiny));
        const Vector enter = (Vector(-limit) - x) / slope, leave = (Vector(limit) - x) / slope;
        first = Vector::larger(first, Vector::smaller(enter, leave));
        last = Vector::smaller(last, Vector::larger(enter, leave));
    }

    /// Edges, each from a corner to the next.
    void addEdges()
    {
        const Vector x = m_x[0], y = m_y[0], d = m_distances[0];
        const Vector alongX = x.template lanes<1, 2, 3, 0>() - x, alongY = y.template lanes<1, 2, 3, 0>() - y;
        const Vector alongD = d.template lanes<1, 2, 3, 0>() - d;
        Vector first(S(0)), last(S(1));
        cut(x, alongX, m_faces.halfX() + m_noise, first, last);
        cut(y, alongY, m_faces.halfY() + m_noise, first, last);
        const Vector isLeft = first <= last;
        first = Vector::smaller(first, Vector(S(1)));
        last = Vector::larger(last, Vector(S(0)));
        m_whole = (first == Vector(S(0))).bits();
        set(0, x + first * alongX, y + first * alongY, d + first * alongD, isLeft);
        // An edge that ends in a corner ends where the next one begins.
        set(2, x + last * alongX, y + last * alongY, d + last * alongD, isLeft & (Vector(S(1)) > last));
    }

    const BoxFaces<Vector>& m_faces;
    S m_noise;  ///< bound of the rounding error of a corner
    S m_apart;
    unsigned m_whole = 0;
    Vector m_x[kGroups], m_y[kGroups], m_distances[kGroups], m_areThere[kGroups];
};
}  // namespace cullet
