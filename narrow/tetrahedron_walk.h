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
/// a face, the support point beyond the farthest such face takes the place of the point opposite. That is GJK where the
/// origin projects into the face, and cheaper elsewhere, since it needs no closest point; it may fail where GJK would
/// not, and then the search in double goes on from its points. Both answers are proved: an axis by HullPair::test(), a
/// tetrahedron by signs that are certain.
template <class S, class Observer>
class TetrahedronWalk
{
public:
    TetrahedronWalk(const HullPair<S>& pair, S limit2, Observer& observer)
        : m_pair(pair), m_limit2(limit2), m_observer(observer)
    {
    }

    /// Starts from remembered vertex pairs. @return false if one of them does not exist
    template <class C>
    bool load(const GjkCache<C>& cache)
    {
        bool isKnown = true;
        for (int i = 0; i < 4; ++i)
        {
            m_vertexA[i] = cache.verticesA[i];
            m_vertexB[i] = cache.verticesB[i];
            isKnown =
                isKnown && m_vertexA[i] < m_pair.a().vertexCount() && m_vertexB[i] < m_pair.b().vertexCount();
        }
        if (isKnown)
            placeAll();
        return isKnown;
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
        cache.startA = narrowId<C>(m_vertexA[m_newest]);
        cache.startB = narrowId<C>(m_vertexB[m_newest]);
    }

    const std::array<S, 3>& axis() const { return m_axis; }

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

    void replace(int lane, std::int32_t vertexA, std::int32_t vertexB)
    {
        m_vertexA[lane] = vertexA;
        m_vertexB[lane] = vertexB;
        const Point p = placed(lane);
        Quad<S>::replace(m_p.x, lane, p[0]);
        Quad<S>::replace(m_p.y, lane, p[1]);
        Quad<S>::replace(m_p.z, lane, p[2]);
    }

    /// The face that the origin is farthest outside of; -1 if none, and then m_isProved.
    int outsideFace()
    {
        const Points q = {__builtin_shufflevector(m_p.x, m_p.x, 1, 2, 3, 0),
                          __builtin_shufflevector(m_p.y, m_p.y, 1, 2, 3, 0),
                          __builtin_shufflevector(m_p.z, m_p.z, 1, 2, 3, 0)};
        const Points e = {__builtin_shufflevector(m_p.x, m_p.x, 2, 3, 0, 1) - q.x,
                          __builtin_shufflevector(m_p.y, m_p.y, 2, 3, 0, 1) - q.y,
                          __builtin_shufflevector(m_p.z, m_p.z, 2, 3, 0, 1) - q.z};
        const Points f = {__builtin_shufflevector(m_p.x, m_p.x, 3, 0, 1, 2) - q.x,
                          __builtin_shufflevector(m_p.y, m_p.y, 3, 0, 1, 2) - q.y,
                          __builtin_shufflevector(m_p.z, m_p.z, 3, 0, 1, 2) - q.z};
        m_normal = {e.y * f.z - e.z * f.y, e.z * f.x - e.x * f.z, e.x * f.y - e.y * f.x};
        const Vector height = m_normal.x * q.x + m_normal.y * q.y + m_normal.z * q.z;
        // The volume, with the sign that says on which side of the face its opposite point lies.
        const Vector side = m_normal.x * m_p.x + m_normal.y * m_p.y + m_normal.z * m_p.z - height;
        // Positive: the origin is beyond the face, seen from the opposite point.
        m_isUp = side > S(0);
        const Vector beyond = m_isUp ? height : -height;
        Vector doubt, depth = side, size = beyond;
        boundErrors(q, e, f, doubt);
        Quad<S>::makePositive(depth);
        Quad<S>::makePositive(size);
        if (isAllPositive(-beyond - doubt) && isAllPositive(depth - doubt))
        {
            m_isProved = true;
            return -1;
        }
        const Vector norm2 = m_normal.x * m_normal.x + m_normal.y * m_normal.y + m_normal.z * m_normal.z;
        const Vector score = beyond * size / norm2;
        const int best = Quad<S>::indexOfLargest(score);
        return score[best] > S(0) ? best : -1;
    }

    static bool isAllPositive(const Vector& v)
    {
        return v[0] > S(0) && v[1] > S(0) && v[2] > S(0) && v[3] > S(0);
    }

    static void sumMagnitudes(const Points& p, Vector& sum)
    {
        Points positive = p;
        Quad<S>::makePositive(positive.x);
        Quad<S>::makePositive(positive.y);
        Quad<S>::makePositive(positive.z);
        sum = positive.x + positive.y + positive.z;
    }

    /// Bounds of the errors of heights and volumes. With d the error of a coordinate, u of a rounding, and |x| 1-norms:
    /// the components of a normal are off by 4 d (|e| + |f|) + 5 u |e| |f| together, and their sum is at most |e| |f|.
    /// A product with a point x adds |e| |f| d + 4 u |e| |f| |x|. Here |x| stands for two points, as in the volume.
    void boundErrors(const Points& q, const Points& e, const Points& f, Vector& doubt) const
    {
        constexpr S kEpsilon = std::numeric_limits<S>::epsilon();
        Vector ofE, ofF, ofQ, ofP;
        sumMagnitudes(e, ofE);
        sumMagnitudes(f, ofF);
        sumMagnitudes(q, ofQ);
        sumMagnitudes(m_p, ofP);
        const Vector x = ofQ + ofP;
        const S d = S(2.6) * kEpsilon * m_pair.reach();
        doubt = d * (S(4) * x * (ofE + ofF) + S(2) * ofE * ofF) + S(5) * kEpsilon * x * ofE * ofF;
    }

    /// @return true if the axis of the face separates; else the support point along it has taken the opposite place
    bool stepBeyond(int face)
    {
        const S sign = m_isUp[face] != 0 ? S(1) : S(-1);
        const AxisTest<S> test =
            testAlong({m_normal.x[face] * sign, m_normal.y[face] * sign, m_normal.z[face] * sign});
        if (!isStuckAt(test, face))
            replace(face, test.vertexA, test.vertexB);
        m_newest = face;
        return test.isProved;
    }

    /// Not from a vertex at hand: where measured, a climb takes longer than the scan or the table.
    AxisTest<S> testAlong(const Point& direction)
    {
        const S scale =
            S(1) / std::max({std::abs(direction[0]), std::abs(direction[1]), std::abs(direction[2])});
        for (int i = 0; i < 3; ++i)
            m_axis[i] = std::min(std::max(direction[i] * scale, S(-1)), S(1));
        const AxisTest<S> test = m_pair.test(m_axis[0], m_axis[1], m_axis[2], m_limit2, -1, -1);
        m_observer(Eigen::Vector3d(m_axis[0], m_axis[1], m_axis[2]), static_cast<double>(test.along));
        return test;
    }

    /// A support point that is there already, in another place than that of the point to go, or none.
    bool isStuckAt(const AxisTest<S>& test, int gone)
    {
        m_isStuck = test.vertexA < 0;
        for (int i = 0; i < 4; ++i)
            m_isStuck |= i != gone && m_vertexA[i] == test.vertexA && m_vertexB[i] == test.vertexB;
        return m_isStuck;
    }

    Point placed(int i) const
    {
        const Vector& o = m_pair.offset();
        const auto world = [](const PosedHull<S>& shape, std::int32_t vertex)
        {
            const Point p = shape.hull().vertex(vertex);
            return Point(shape.row(0)[0] * p[0] + shape.row(0)[1] * p[1] + shape.row(0)[2] * p[2],
                         shape.row(1)[0] * p[0] + shape.row(1)[1] * p[1] + shape.row(1)[2] * p[2],
                         shape.row(2)[0] * p[0] + shape.row(2)[1] * p[1] + shape.row(2)[2] * p[2]);
        };
        return world(m_pair.a(), m_vertexA[i]) - world(m_pair.b(), m_vertexB[i]) - Point(o[0], o[1], o[2]);
    }

    const HullPair<S>& m_pair;
    S m_limit2;
    Observer& m_observer;
    std::array<std::int32_t, 4> m_vertexA, m_vertexB;
    Points m_p, m_normal;
    Mask m_isUp;
    std::array<S, 3> m_axis = {};
    std::int32_t m_iterations = 0;
    int m_newest = 0;
    bool m_isProved = false;
    bool m_isStuck = false;
};
}  // namespace cullet
