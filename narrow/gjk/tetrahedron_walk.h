// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/gjk/gjk_types.h"
#include "cullet/narrow/gjk/hull_pair.h"
#include "cullet/narrow/math/lanes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace cullet
{
/// Searches for a tetrahedron of A - B around the origin, or a separating axis, in the scalar of the hulls.
///
/// The four points lie in four lanes, and lane f also holds the face opposite to point f. While the origin is outside
/// of a face, the support point w beyond the farthest such face is added. If it is the only such face, the ray from the
/// opposite point through the origin passes through it and leaves by one of the three triangles of w and an edge: the
/// third corner is removed, as in the portal refinement of XenoCollide (Snethen 2008, "Complex Collision Made Simple",
/// Game Programming Gems 7), and no part that encloses the origin is lost. Else the opposite point is removed. That is
/// cheaper than GJK, since it needs no closest point; it may fail where GJK would not, and then the search in double
/// continues from its points. Both answers are proved: an axis by HullPair::test(), a tetrahedron by signs that are
/// certain.
template <class S, class Observer>
class TetrahedronWalk
{
public:
    TetrahedronWalk(const HullPair<S>& pair, S limit2, Observer& observer)
        : m_pair(pair), m_limit2(limit2), m_observer(observer)
    {
    }

    /// Walks from four vertex pairs.
    ///
    /// @return Separated or Overlapping if that is proved, else NotConverged
    [[gnu::always_inline]] GjkState run(const std::array<std::int32_t, 4>& verticesA,
                                        const std::array<std::int32_t, 4>& verticesB)
    {
        place(verticesA, verticesB);
        for (; m_iterations <= kLimit; ++m_iterations)
        {
            Faces faces(m_p, m_pair.reach());
            if (faces.areProved())
                return GjkState::Overlapping;
            const unsigned outside = faces.outside(m_p);
            if (outside == 0)
                return GjkState::NotConverged;
            const int face = faces.farthest(outside);
            const bool isOutsideOfOne = (outside & (outside - 1)) == 0;
            const Point w = testBeyond(faces, face, isOutsideOfOne);
            if (isStuck())
                return m_test.isProved ? GjkState::Separated : GjkState::NotConverged;
            replace(isOutsideOfOne ? laneToReplace(face, w, faces.isNormalOutward(face)) : face, w);
            if (m_test.isProved)
                return GjkState::Separated;
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
        rememberAxis(scaledAxis(m_pair.tilted(m_axis, m_test, kTilt)), cache);
        cache.startA = narrowId<C>(m_test.vertexA);
        cache.startB = narrowId<C>(m_test.vertexB);
    }

    const Eigen::Matrix<S, 3, 1>& axis() const { return m_axis; }

private:
    using Vector = typename Quad<S>::Vector;
    using Point = Eigen::Matrix<S, 3, 1>;
    using Ids = Lanes<float>::Mask;

    static constexpr std::int32_t kLimit = 6;
    /// Tilt of the first step's direction; later steps, which are longer, tilt less. Measured from .3 to 1.2: .8 to 1
    /// are equally good.
    static constexpr S kSlope = S(0.9);
    /// Tilt of a face's normal that is cached as an axis. Measured from .02 to 1: .4 to .6 avoid the most searches.
    static constexpr S kTilt = S(0.5);

    struct Points
    {
        Vector x, y, z;
    };

    /// Point f + kBy in lane f.
    template <int kBy>
    [[gnu::always_inline]] static Points turned(const Points& p)
    {
        return {CULLET_SHUFFLE(p.x, p.x, kBy, (1 + kBy) & 3, (2 + kBy) & 3, (3 + kBy) & 3),
                CULLET_SHUFFLE(p.y, p.y, kBy, (1 + kBy) & 3, (2 + kBy) & 3, (3 + kBy) & 3),
                CULLET_SHUFFLE(p.z, p.z, kBy, (1 + kBy) & 3, (2 + kBy) & 3, (3 + kBy) & 3)};
    }

    /// Position of the origin relative to the faces; lane f is the face opposite to point f.
    class Faces
    {
    public:
        [[gnu::always_inline]] Faces(const Points& p, S reach)
        {
            const Points q = turned<1>(p), r = turned<2>(p), s = turned<3>(p);
            // Weight of the opposite point for the origin, times the volume.
            m_weight = kParity * (q.x * (r.y * s.z - r.z * s.y) + q.y * (r.z * s.x - r.x * s.z) +
                                  q.z * (r.x * s.y - r.y * s.x));
            setErrorBound(p, reach);
        }

        /// Whether the origin is proved to be inside.
        bool areProved() const
        {
            constexpr unsigned kAll = 15;
            return quadBits<S>(m_weight > m_errorBound) == kAll ||
                   quadBits<S>(-m_weight > m_errorBound) == kAll;
        }

        /// Bit f: the origin is outside of face f.
        [[gnu::always_inline]] unsigned outside(const Points& p)
        {
            m_volume = m_weight[0] + m_weight[1] + m_weight[2] + m_weight[3];
            const Points q = turned<1>(p), r = turned<2>(p), s = turned<3>(p);
            const Points e = {r.x - q.x, r.y - q.y, r.z - q.z};
            const Points f = {s.x - q.x, s.y - q.y, s.z - q.z};
            m_normal = {e.y * f.z - e.z * f.y, e.z * f.x - e.x * f.z, e.x * f.y - e.y * f.x};
            m_beyond = m_volume > S(0) ? -m_weight : m_weight;
            return quadBits<S>(m_beyond > Vector{});
        }

        /// The face of a set that the origin is farthest outside of.
        int farthest(unsigned outside) const
        {
            if ((outside & (outside - 1)) == 0)
                return __builtin_ctz(outside);
            Vector norm2, beyond2;
            findDistances(norm2, beyond2);
            const int best = Quad<S>::indexOfLargest(beyond2);
            // If squares underflow, any face of the set will do.
            return (outside >> best & 1u) != 0 ? best : __builtin_ctz(outside);
        }

        /// A direction away from a face and, less steeply, from the other face nearest to the origin: the support point
        /// in that direction is where both faces meet, and the tetrahedron with it still contains the origin after
        /// further motion.
        ///
        /// @param slope weight of the second face's unit normal; that of the first is 1
        Point tiltedNormal(int face, S slope) const
        {
            Vector norm2, beyond2;
            findDistances(norm2, beyond2);
            Quad<S>::replace(beyond2, face, std::numeric_limits<S>::lowest());
            const int second = Quad<S>::indexOfLargest(beyond2);
            if (!(norm2[second] > S(0)))
                return normal(face);
            const S ratio = norm2[face] / norm2[second];
            if (!(ratio <= std::numeric_limits<S>::max()))
                return normal(face);
            return normal(face) + normal(second) * (slope * squareRoot(ratio));
        }

        /// Whether the normal as computed points outwards.
        bool isNormalOutward(int face) const { return ((face & 1) != 0 ? -m_volume : m_volume) < S(0); }
        /// Outwards, of any length.
        Point normal(int face) const
        {
            const S sign = isNormalOutward(face) ? S(1) : S(-1);
            return {m_normal.x[face] * sign, m_normal.y[face] * sign, m_normal.z[face] * sign};
        }

    private:
        /// @param norm2   [out] of the normals, squared
        /// @param beyond2 [out] signed square of the distance by which the origin is outside of each face
        [[gnu::always_inline]] void findDistances(Vector& norm2, Vector& beyond2) const
        {
            norm2 = m_normal.x * m_normal.x + m_normal.y * m_normal.y + m_normal.z * m_normal.z;
            Vector size = m_beyond;
            Quad<S>::makePositive(size);
            // For a face without area the distance is nearly 0.
            Vector divisor = norm2;
            Quad<S>::replaceZeros(divisor);
            beyond2 = m_beyond * size / divisor;
        }

        static constexpr Vector kParity = {S(1), S(-1), S(1), S(-1)};

        /// Bounds the errors of the determinants. With d the error of a coordinate, u that of a rounding, and |x|
        /// 1-norms: the three points contribute d (|r| |s| + |s| |q| + |q| |r|), where 3 d are added to each norm for
        /// products of errors; rounding contributes 5.3 u |q| |r| |s|. Underflow, in the determinants and in this
        /// bound, loses less than 16 times the smallest normal number, even with flush to zero: a dozen products at
        /// most. Where coordinates above 1 could magnify that loss, the other bounds are far larger.
        [[gnu::always_inline]] void setErrorBound(const Points& p, S reach)
        {
            constexpr S kEpsilon = std::numeric_limits<S>::epsilon();
            const S d = S(2.6) * kEpsilon * reach;
            Points positive = p;
            Quad<S>::makePositive(positive.x);
            Quad<S>::makePositive(positive.y);
            Quad<S>::makePositive(positive.z);
            const Vector norm = positive.x + positive.y + positive.z + S(3) * d;
            const Vector ofQ = CULLET_SHUFFLE(norm, norm, 1, 2, 3, 0);
            const Vector ofR = CULLET_SHUFFLE(norm, norm, 2, 3, 0, 1);
            const Vector ofS = CULLET_SHUFFLE(norm, norm, 3, 0, 1, 2);
            const Vector ofRS = ofR * ofS;
            constexpr S kUnderflow = S(16) * std::numeric_limits<S>::min();
            m_errorBound = d * (ofRS + ofQ * (ofR + ofS)) + S(3) * kEpsilon * (ofQ * ofRS) + kUnderflow;
        }

        Points m_normal;
        Vector m_weight, m_errorBound, m_beyond;
        S m_volume = S(0);
    };

    [[gnu::always_inline]] static Points gather(const PosedHull<S>& shape,
                                                const std::array<std::int32_t, 4>& v)
    {
        const Hull<S>& h = shape.hull();
        Vector a, b, c, d;
        Quad<S>::load(h.lanes(v[0]), a);
        Quad<S>::load(h.lanes(v[1]), b);
        Quad<S>::load(h.lanes(v[2]), c);
        Quad<S>::load(h.lanes(v[3]), d);
        const Vector lowAB = CULLET_SHUFFLE(a, b, 0, 4, 1, 5), lowCD = CULLET_SHUFFLE(c, d, 0, 4, 1, 5);
        const Vector highAB = CULLET_SHUFFLE(a, b, 2, 6, 3, 7), highCD = CULLET_SHUFFLE(c, d, 2, 6, 3, 7);
        const Vector x = CULLET_SHUFFLE(lowAB, lowCD, 0, 1, 4, 5);
        const Vector y = CULLET_SHUFFLE(lowAB, lowCD, 2, 3, 6, 7);
        const Vector z = CULLET_SHUFFLE(highAB, highCD, 0, 1, 4, 5);
        const Vector &r = shape.row(0), &s = shape.row(1), &t = shape.row(2);
        return {r[0] * x + r[1] * y + r[2] * z, s[0] * x + s[1] * y + s[2] * z,
                t[0] * x + t[1] * y + t[2] * z};
    }

    [[gnu::always_inline]] void place(const std::array<std::int32_t, 4>& verticesA,
                                      const std::array<std::int32_t, 4>& verticesB)
    {
        const Points a = gather(m_pair.a(), verticesA);
        const Points b = gather(m_pair.b(), verticesB);
        const Vector& o = m_pair.offset();
        m_p = {a.x - b.x - o[0], a.y - b.y - o[1], a.z - b.z - o[2]};
        std::memcpy(&m_vertexA, verticesA.data(), sizeof(m_vertexA));
        std::memcpy(&m_vertexB, verticesB.data(), sizeof(m_vertexB));
    }

    /// Finds the support point beyond a face, along its normal; if the origin is outside of no other face, first along
    /// a tilted direction, whose support point is used if it lies beyond the face, too.
    [[gnu::always_inline]] Point testBeyond(const Faces& faces, int face, bool isOutsideOfOne)
    {
        const Point normal = faces.normal(face);
        const S heightOfFace = normal.dot(corner((face + 1) & 3));
        for (bool isTilted = isOutsideOfOne;; isTilted = false)
        {
            m_axis = isTilted ? faces.tiltedNormal(face, kSlope / S(1 + m_iterations)) : normal;
            if (!HullPair<S>::isTestable(m_axis))
                m_axis = scaledAxis(m_axis);
            // Without a start vertex: where measured, a climb takes longer than the scan or the table.
            m_test = m_pair.testWithoutStart(m_axis, m_limit2);
            if (m_test.vertexA >= 0)
                m_observer(m_axis.template cast<double>(), static_cast<double>(m_test.along));
            const Point w =
                m_test.vertexA >= 0 ? m_pair.point(m_test.vertexA, m_test.vertexB) : Point::Zero();
            if (!isTilted || m_test.isProved || (!isStuck() && normal.dot(w) < heightOfFace))
                return w;
        }
    }

    Point corner(int lane) const { return {m_p.x[lane], m_p.y[lane], m_p.z[lane]}; }

    /// The lane of the corner to replace: the ray from the opposite point through the origin leaves by the triangle of
    /// w and an edge of the face, and the corner is not in that triangle. The plane of the ray and w separates the ends
    /// of that edge.
    int laneToReplace(int face, const Point& w, bool isNormalOutward) const
    {
        const Point m = corner(face).cross(w);
        const Vector s = m[0] * m_p.x + m[1] * m_p.y + m[2] * m_p.z;
        const unsigned bits = quadBits<S>(isNormalOutward ? s > Vector{} : s < Vector{});
        // Index: the bits of the corners face + 1, + 2 and + 3. Entry: which of them to replace; 0: the opposite one.
        constexpr unsigned kReplacedCorners =
            0 | 3 << 2 | 1 << 4 | 1 << 6 | 2 << 8 | 3 << 10 | 2 << 12 | 0 << 14;
        const unsigned ofCorners = ((bits | bits << 4) >> (face + 1)) & 7u;
        return (face + static_cast<int>(kReplacedCorners >> (2 * ofCorners) & 3u)) & 3;
    }

    [[gnu::always_inline]] void replace(int lane, const Point& w)
    {
        Quad<S>::replace(m_p.x, lane, w[0]);
        Quad<S>::replace(m_p.y, lane, w[1]);
        Quad<S>::replace(m_p.z, lane, w[2]);
        constexpr Ids kCounting = {0, 1, 2, 3};
        const Ids isThis = kCounting == Ids{} + lane;
        m_vertexA = isThis ? Ids{} + m_test.vertexA : m_vertexA;
        m_vertexB = isThis ? Ids{} + m_test.vertexB : m_vertexB;
    }

    /// Whether the support point is already in the tetrahedron, or there is none.
    bool isStuck() const
    {
        return m_test.vertexA < 0 ||
               laneBits((m_vertexA == m_test.vertexA) & (m_vertexB == m_test.vertexB)) != 0;
    }

    const HullPair<S>& m_pair;
    S m_limit2;
    Observer& m_observer;
    Ids m_vertexA, m_vertexB;
    Points m_p;
    Point m_axis = Point::Zero();
    AxisTest<S> m_test;
    std::int32_t m_iterations = 0;
};
}  // namespace cullet
