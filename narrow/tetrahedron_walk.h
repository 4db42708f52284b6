// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/gjk_types.h"
#include "narrow/hull_pair.h"
#include "narrow/lanes.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace cullet
{
/// Looks for a tetrahedron of A - B around the origin, or an axis that separates, in the scalar of the hulls.
///
/// The four points lie in four lanes, and lane f also holds the face opposite to point f. While the origin is outside of
/// a face, the support point w beyond the farthest such face comes in. If it is the only such face, the ray from the
/// opposite point through the origin passes through it and leaves by one of the three triangles of w and an edge: the
/// third corner goes, as in the portal refinement of XenoCollide (Snethen 2008, "Complex Collision Made Simple", Game
/// Programming Gems 7), and nothing that encloses the origin is lost. Else the point opposite goes. That is cheaper than
/// GJK, since it needs no closest point; it may fail where GJK would not, and then the search in double goes on from its
/// points. Both answers are proved: an axis by HullPair::test(), a tetrahedron by signs that are certain.
template <class S, class Observer>
class TetrahedronWalk
{
public:
    TetrahedronWalk(const HullPair<S>& pair, S limit2, Observer& observer)
        : m_pair(pair), m_limit2(limit2), m_observer(observer)
    {
    }

    /// Starts from four vertex pairs.
    void start(const std::array<std::int32_t, 4>& verticesA, const std::array<std::int32_t, 4>& verticesB)
    {
        m_vertexA = verticesA;
        m_vertexB = verticesB;
        placeAll();
    }

    /// @return Separated or Overlapping if that is proved, else NotConverged
    GjkState run()
    {
        for (; m_iterations <= kLimit; ++m_iterations)
        {
            const int face = outsideFace();
            if (face < 0)
                return m_isProved ? GjkState::Overlapping : GjkState::NotConverged;
            if (stepBeyond(face))
                return GjkState::Separated;
            if (m_isStuck)
                break;
        }
        return GjkState::NotConverged;
    }

    std::int32_t iterations() const { return m_iterations; }

    template <class C>
    void remember(GjkState state, GjkCache<C>& cache) const
    {
        cache.state = state;
        cache.count = 4;
        for (int i = 0; i < 4; ++i)
        {
            cache.verticesA[i] = narrowId<C>(m_vertexA[i]);
            cache.verticesB[i] = narrowId<C>(m_vertexB[i]);
        }
        if (state != GjkState::Separated)
            return;
        for (int i = 0; i < 3; ++i)
            cache.axis[i] = static_cast<float>(m_axis[i]);
        cache.startA = narrowId<C>(m_startA);
        cache.startB = narrowId<C>(m_startB);
    }

    const Eigen::Matrix<S, 3, 1>& axis() const { return m_axis; }

private:
    using Vector = typename Quad<S>::Vector;
    using Mask = typename Quad<S>::Mask;
    using Point = Eigen::Matrix<S, 3, 1>;

    static constexpr std::int32_t kLimit = 6;

    struct Points
    {
        Vector x, y, z;
    };

    static Points gather(const PosedHull<S>& shape, const std::array<std::int32_t, 4>& v)
    {
        const Hull<S>& h = shape.hull();
        const Vector x = {h.x()[v[0]], h.x()[v[1]], h.x()[v[2]], h.x()[v[3]]};
        const Vector y = {h.y()[v[0]], h.y()[v[1]], h.y()[v[2]], h.y()[v[3]]};
        const Vector z = {h.z()[v[0]], h.z()[v[1]], h.z()[v[2]], h.z()[v[3]]};
        const Vector &r = shape.row(0), &s = shape.row(1), &t = shape.row(2);
        return {r[0] * x + r[1] * y + r[2] * z, s[0] * x + s[1] * y + s[2] * z,
                t[0] * x + t[1] * y + t[2] * z};
    }

    void placeAll()
    {
        const Points a = gather(m_pair.a(), m_vertexA);
        const Points b = gather(m_pair.b(), m_vertexB);
        const Vector& o = m_pair.offset();
        m_p = {a.x - b.x - o[0], a.y - b.y - o[1], a.z - b.z - o[2]};
    }

    /// The face that the origin is farthest outside of; -1 if none, and then m_isProved if that is certain.
    int outsideFace()
    {
        const Points q = {__builtin_shufflevector(m_p.x, m_p.x, 1, 2, 3, 0),
                          __builtin_shufflevector(m_p.y, m_p.y, 1, 2, 3, 0),
                          __builtin_shufflevector(m_p.z, m_p.z, 1, 2, 3, 0)};
        const Points r = {__builtin_shufflevector(m_p.x, m_p.x, 2, 3, 0, 1),
                          __builtin_shufflevector(m_p.y, m_p.y, 2, 3, 0, 1),
                          __builtin_shufflevector(m_p.z, m_p.z, 2, 3, 0, 1)};
        const Points s = {__builtin_shufflevector(m_p.x, m_p.x, 3, 0, 1, 2),
                          __builtin_shufflevector(m_p.y, m_p.y, 3, 0, 1, 2),
                          __builtin_shufflevector(m_p.z, m_p.z, 3, 0, 1, 2)};
        // Weight of the opposite point for the origin, times the volume.
        constexpr Vector kParity = {S(1), S(-1), S(1), S(-1)};
        const Vector weight = kParity * (q.x * (r.y * s.z - r.z * s.y) + q.y * (r.z * s.x - r.x * s.z) +
                                         q.z * (r.x * s.y - r.y * s.x));
        Vector doubt;
        boundErrors(doubt);
        constexpr unsigned kAll = 15;
        if (quadBits<S>(weight > doubt) == kAll || quadBits<S>(-weight > doubt) == kAll)
        {
            m_isProved = true;
            return -1;
        }
        const S volume = weight[0] + weight[1] + weight[2] + weight[3];
        const Vector beyond = volume > S(0) ? -weight : weight;
        m_outside = quadBits<S>(beyond > S(0));
        if (m_outside == 0)
            return -1;
        m_isUp = kParity * volume < S(0);
        const Points e = {r.x - q.x, r.y - q.y, r.z - q.z};
        const Points f = {s.x - q.x, s.y - q.y, s.z - q.z};
        m_normal = {e.y * f.z - e.z * f.y, e.z * f.x - e.x * f.z, e.x * f.y - e.y * f.x};
        const Vector norm2 = m_normal.x * m_normal.x + m_normal.y * m_normal.y + m_normal.z * m_normal.z;
        Vector size = beyond;
        Quad<S>::makePositive(size);
        const Vector score = beyond * size / norm2;
        const int best = Quad<S>::indexOfLargest(score);
        return score[best] > S(0) ? best : -1;
    }

    /// Bounds of the errors of the determinants. With d the error of a coordinate, u of a rounding, and |x| 1-norms: of
    /// the three points, d (|r| |s| + |s| |q| + |q| |r|), where 3 d are added to each norm for products of errors; of
    /// rounding, 5.3 u |q| |r| |s|. What is lost by underflow, there and here, is less than 16 times the smallest normal
    /// number, even if that is flushed to 0: a dozen products at most. Where coordinates of size 1 could make more of one,
    /// the other bounds are larger by far.
    void boundErrors(Vector& doubt) const
    {
        constexpr S kEpsilon = std::numeric_limits<S>::epsilon();
        const S d = S(2.6) * kEpsilon * m_pair.reach();
        Points positive = m_p;
        Quad<S>::makePositive(positive.x);
        Quad<S>::makePositive(positive.y);
        Quad<S>::makePositive(positive.z);
        const Vector norm = positive.x + positive.y + positive.z + S(3) * d;
        const Vector ofQ = __builtin_shufflevector(norm, norm, 1, 2, 3, 0);
        const Vector ofR = __builtin_shufflevector(norm, norm, 2, 3, 0, 1);
        const Vector ofS = __builtin_shufflevector(norm, norm, 3, 0, 1, 2);
        const Vector ofRS = ofR * ofS;
        constexpr S kUnderflow = S(16) * std::numeric_limits<S>::min();
        doubt = d * (ofRS + ofQ * (ofR + ofS)) + S(3) * kEpsilon * (ofQ * ofRS) + kUnderflow;
    }

    /// @return true if the axis of the face separates; the support point along it comes in
    bool stepBeyond(int face)
    {
        const S sign = m_isUp[face] != 0 ? S(1) : S(-1);
        const AxisTest<S> test =
            testAlong({m_normal.x[face] * sign, m_normal.y[face] * sign, m_normal.z[face] * sign});
        m_startA = test.vertexA;
        m_startB = test.vertexB;
        if (!isStuckAt(test))
        {
            const Point w = m_pair.point(test.vertexA, test.vertexB);
            const bool isOutsideOfOne = (m_outside & (m_outside - 1)) == 0;
            const int lane = isOutsideOfOne ? laneToGo(face, w) : face;
            m_vertexA[lane] = test.vertexA;
            m_vertexB[lane] = test.vertexB;
            Quad<S>::replace(m_p.x, lane, w[0]);
            Quad<S>::replace(m_p.y, lane, w[1]);
            Quad<S>::replace(m_p.z, lane, w[2]);
        }
        return test.isProved;
    }

    /// The lane of the corner that is not in the triangle of w and an edge of the face by which the ray from the opposite
    /// point through the origin leaves. The plane of that ray and w has the ends of the edge on different sides.
    int laneToGo(int face, const Point& w) const
    {
        const Point p(m_p.x[face], m_p.y[face], m_p.z[face]);
        const Point m = p.cross(w);
        const Vector s = m[0] * m_p.x + m[1] * m_p.y + m[2] * m_p.z;
        const S sign = m_isUp[face] != 0 ? S(1) : S(-1);
        const int i = (face + 1) & 3, j = (face + 2) & 3, k = (face + 3) & 3;
        const bool si = s[i] * sign > S(0), sj = s[j] * sign > S(0), sk = s[k] * sign > S(0);
        if (si && !sj)
            return k;
        if (sj && !sk)
            return i;
        if (sk && !si)
            return j;
        return face;
    }

    /// Not from a vertex at hand: where measured, a climb takes longer than the scan or the table.
    AxisTest<S> testAlong(const Point& direction)
    {
        m_axis = scaledAxis(direction);
        const AxisTest<S> test = m_pair.test(m_axis[0], m_axis[1], m_axis[2], m_limit2, -1, -1);
        m_observer(m_axis.template cast<double>(), static_cast<double>(test.along));
        return test;
    }

    /// A support point that is there already, or none.
    bool isStuckAt(const AxisTest<S>& test)
    {
        m_isStuck = test.vertexA < 0;
        for (int i = 0; i < 4; ++i)
            m_isStuck |= m_vertexA[i] == test.vertexA && m_vertexB[i] == test.vertexB;
        return m_isStuck;
    }

    const HullPair<S>& m_pair;
    S m_limit2;
    Observer& m_observer;
    std::array<std::int32_t, 4> m_vertexA, m_vertexB;
    Points m_p, m_normal;
    Mask m_isUp;
    Point m_axis = Point::Zero();
    std::int32_t m_iterations = 0;
    unsigned m_outside = 0;  ///< bit i: the origin is outside of face i
    std::int32_t m_startA = -1, m_startB = -1;
    bool m_isProved = false;
    bool m_isStuck = false;
};
}  // namespace cullet
