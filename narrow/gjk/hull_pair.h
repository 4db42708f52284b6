// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/posed_hull.h"
#include "cullet/narrow/math/lanes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace cullet
{
/// The support of A - B against an axis v, in the scalar of the hulls.
template <class S>
struct AxisTest
{
    bool isProved = false;  ///< the gap along v is proved to be larger than the limit
    S along = S(0);         ///< v.w for the support point w, rounded
    std::int32_t vertexA = -1;
    std::int32_t vertexB = -1;
};

/// A direction scaled so that its largest component is from a half to 1 in magnitude, for HullPair::test().
template <class S>
inline Eigen::Matrix<S, 3, 1> scaledAxis(const Eigen::Matrix<S, 3, 1>& direction)
{
    return direction *
           scaleBelowOne(std::max({std::abs(direction[0]), std::abs(direction[1]), std::abs(direction[2])}));
}

/// The square of a distance for HullPair::test(): exact unless it would underflow, else larger. If the larger gap is
/// not proved, the search in double answers.
///
/// In float, 1e-18 times a distance below 1e-18 exceeds its square by far more than underflow can lose, down to
/// distances of 1.5e-23. Below that it suffices that the tested square is not 0: its root is at least 2.6e-23, divided
/// by an axis of at most the root of 3. A longer axis belongs to an A - B of at least half that length, of whose size a
/// proved distance is at least 3e-14. Likewise in double.
template <class S>
inline S squareOfLimit(S limit)
{
    constexpr S kMinFactor = sizeof(S) == sizeof(float) ? S(1e-18) : S(1e-153);
    return limit * std::max(limit, kMinFactor);
}

/// Two posed hulls, for tests in their own scalar with a bound of the rounding errors, instead of points in double.
/// What these tests cannot prove is left to the search in double.
///
/// With u the unit of rounding, R the radius of a hull and F the Frobenius norm of its basis, the error of a local
/// direction is 3 u times the sum of the magnitudes of its products, and so is that of a height. By Cauchy and Schwarz
/// the height is off by 6 u F R |v| in total, the product with the offset by 4 u |v| times the offset, and their sum by
/// 3 u of all terms. 10 u |v| times reach() covers it; u is eps / 2, and |v| at most sqrt(3) or its 1-norm. A
/// coordinate of a point of A - B is off by 5 u reach().
template <class S>
class HullPair
{
public:
    using Vector = typename Quad<S>::Vector;
    using Point = Eigen::Matrix<S, 3, 1>;

    // Without inlining a query takes a tenth longer.
    [[gnu::always_inline]] HullPair(const PosedHull<S>& a, const PosedHull<S>& b)
        : m_a(a), m_b(b), m_offset(b.originQuad() - a.originQuad())
    {
        Vector distances = m_offset;
        Quad<S>::makePositive(distances);
        m_reach = a.size() + b.size() + Quad<S>::sumOfThree(distances);
    }

    const PosedHull<S>& a() const { return m_a; }
    const PosedHull<S>& b() const { return m_b; }
    const Vector& offset() const { return m_offset; }
    /// Bounds every coordinate of A - B and every term in it.
    S reach() const { return m_reach; }
    /// Bounds the distance between a point of A - B and the difference of the origins, for rotations.
    S size() const { return S(0.5774) * (m_a.size() + m_b.size()); }

    /// The point of A - B of two vertices, rounded.
    [[gnu::always_inline]] Point point(std::int32_t vertexA, std::int32_t vertexB) const
    {
        Vector ofA, ofB, sums;
        Quad<S>::load(m_a.hull().lanes(vertexA), ofA);
        Quad<S>::load(m_b.hull().lanes(vertexB), ofB);
        sumThreeOfEach(m_a.row(0) * ofA - m_b.row(0) * ofB, m_a.row(1) * ofA - m_b.row(1) * ofB,
                       m_a.row(2) * ofA - m_b.row(2) * ofB, sums);
        sums -= m_offset;
        return {sums[0], sums[1], sums[2]};
    }

    /// An axis tilted towards its support point, for the cache: along the normal of a face or an edge several points
    /// are level, and while the shape rests each later query would have to search for the lowest index among them. The
    /// tilted axis proves nothing.
    ///
    /// @param by the tilt in radians for a support point whose lateral distance equals the size of the shapes
    Point tilted(const Point& axis, const AxisTest<S>& test, S by) const
    {
        const S length2 = axis.squaredNorm();
        // For two points the line between them is the best axis.
        if (!(size() > S(0)))
            return axis;
        const Point lateral = point(test.vertexA, test.vertexB) - axis * (test.along / length2);
        const Point turned = axis + lateral * (by * squareRoot(length2) / size());
        // For very small shapes a quotient may not be finite.
        return isTestable(turned) ? turned : axis;
    }

    /// From the centre of B to that of A, or from origin to origin if both hulls are centred, which needs no
    /// transformation.
    [[gnu::always_inline]] Point betweenCentres() const
    {
        if (m_a.hull().isCentred() && m_b.hull().isCentred())
            return {-m_offset[0], -m_offset[1], -m_offset[2]};
        Vector centreA, centreB, v;
        Quad<S>::load(m_a.hull().centreLanes(), centreA);
        Quad<S>::load(m_b.hull().centreLanes(), centreB);
        sumThreeOfEach(m_a.row(0) * centreA - m_b.row(0) * centreB,
                       m_a.row(1) * centreA - m_b.row(1) * centreB,
                       m_a.row(2) * centreA - m_b.row(2) * centreB, v);
        v -= m_offset;
        return {v[0], v[1], v[2]};
    }

    /// Whether testFirstAxis() and testWithoutStart() accept an axis without scaling: it is neither very long nor very
    /// short.
    [[gnu::always_inline]] static bool isTestable(const Point& axis)
    {
        return isTestable(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    }

    /// Tests whether the distance along an axis is larger than the root of limit2.
    ///
    /// @param limit2 a squareOfLimit()
    /// @param axis   world axes, from B to A; not tested if longer than the root of 3, or tiny
    /// @param startA, startB vertices that are likely near the supports, or -1
    AxisTest<S> test(const Point& axis, S limit2, std::int32_t startA, std::int32_t startB) const
    {
        return testWith<true>(
            axis, limit2, [&](const Vector& localA, const Vector& localB) __attribute__((always_inline)) {
                return Hits{support(m_a, localA, startA), support(m_b, localB, startB)};
            });
    }

    /// test() without start vertices.
    /// @param axis isTestable()
    [[gnu::always_inline]] AxisTest<S> testWithoutStart(const Point& axis, S limit2) const
    {
        return testWith<false>(
            axis, limit2, [&](const Vector& localA, const Vector& localB) __attribute__((always_inline)) {
                return searchBoth(m_a, localA, m_b, localB);
            });
    }

    /// test() of the cached axis, with which most queries end; it then keeps the pair in registers. The support vertex
    /// of a hull with few vertices stays unknown.
    [[gnu::always_inline]] static AxisTest<S> testCachedAxis(const PosedHull<S>& a, const PosedHull<S>& b,
                                                             const Point& axis, S limit2, std::int32_t startA,
                                                             std::int32_t startB)
    {
        const S length2 = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2];
        if (!isInRange<true>(length2))
            return AxisTest<S>();
        Vector localA, localB;
        toLocal(a, b, axis, localA, localB);
        const Hits hits = {height(a, localA, startA), height(b, localB, startB)};
        // A pair constructed earlier would occupy registers that the supports need, which costs a tenth of a query.
        return HullPair(a, b).template evaluate<true>(axis, length2, limit2, hits);
    }

    /// testWithoutStart() with unknown support vertices for hulls of few vertices and for hulls scanned in wide
    /// registers.
    /// @param axis isTestable()
    [[gnu::always_inline]] AxisTest<S> testFirstAxis(const Point& axis, S limit2) const
    {
        return testWith<false>(
            axis, limit2, [&](const Vector& localA, const Vector& localB) __attribute__((always_inline)) {
                if (m_a.hasFewVertices() && m_b.hasFewVertices())
                    return Hits{height(m_a, localA, -1), height(m_b, localB, -1)};
                if (areScannedWide())
                    return wideHeights(localA, localB);
                if (isMapped(m_a) && isMapped(m_b))
                    return searchBoth(m_a, localA, m_b, localB);
                return Hits{height(m_a, localA, -1), height(m_b, localB, -1)};
            });
    }

    /// test() of balls around the origins that contain all vertices, instead of the hulls: needs no support. Proves
    /// nothing for hulls with few vertices, whose supports are as cheap.
    /// @param axis isTestable(), parallel to the difference of the origins if possible
    [[gnu::always_inline]] AxisTest<S> testBalls(const Point& axis, S limit2) const
    {
        const Vector squares = m_offset * m_offset;
        // This rejects most pairs that are too close; size() is a bound for rotations only, so it serves as a filter,
        // not as a proof.
        if ((m_a.hasFewVertices() && m_b.hasFewVertices()) ||
            !(Quad<S>::sumOfThree(squares) > size() * size()))
            return AxisTest<S>();
        return testWith<false>(
            axis, limit2, [&](const Vector& localA, const Vector& localB) __attribute__((always_inline)) {
                return Hits{ballHeight(m_a, localA), ballHeight(m_b, localB)};
            });
    }

private:
    /// Whether both hulls are scanned in wide registers without a start vertex.
    bool areScannedWide() const
    {
        const std::int32_t most = std::max(m_a.vertexCount(), m_b.vertexCount());
        return most > kFewVertices && isScanWide<S>() && most <= linearSupportMaximum<S>() &&
               m_a.method() == SupportMethod::Automatic && m_b.method() == SupportMethod::Automatic;
    }

    static bool isTestable(S length2) { return length2 > S(1e-12) && length2 < S(1e12); }

    /// The sums of the first three lanes of three vectors.
    [[gnu::always_inline]] static void sumThreeOfEach(const Vector& x, const Vector& y, const Vector& z,
                                                      Vector& sums)
    {
        const Vector low = CULLET_SHUFFLE(x, y, 0, 4, 1, 5);
        const Vector high = CULLET_SHUFFLE(x, y, 2, 6, 2, 6);
        const Vector first = CULLET_SHUFFLE(low, z, 0, 1, 4, 7);
        const Vector second = CULLET_SHUFFLE(low, z, 2, 3, 5, 7);
        const Vector third = CULLET_SHUFFLE(high, z, 0, 1, 6, 7);
        sums = first + second + third;
    }

    struct Hits
    {
        SupportHit<S> a, b;
    };

    /// No vertex is higher: its height is a product with the direction, and the ball's height the product of both
    /// lengths. Off by 6.5 u F R |v|.
    [[gnu::always_inline]] static SupportHit<S> ballHeight(const PosedHull<S>& shape, const Vector& d)
    {
        const Vector squares = d * d;
        return {-1, shape.hull().reach() * squareRoot(Quad<S>::sumOfThree(squares))};
    }

    /// The factor of the error bound for the length of an axis.
    template <bool kIsScaled>
    [[gnu::always_inline]] static S boundOfLength(const Point& v)
    {
        return kIsScaled ? S(8.7) : S(5.1) * (std::abs(v[0]) + std::abs(v[1]) + std::abs(v[2]));
    }

    /// @tparam kIsScaled the axis is not longer than the root of 3
    /// @param find returns the support hits for directions in the axes of the hulls
    template <bool kIsScaled, class Find>
    [[gnu::always_inline]] AxisTest<S> testWith(const Point& v, S limit2, const Find& find) const
    {
        const S length2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        if (!isInRange<kIsScaled>(length2))
            return AxisTest<S>();
        Vector localA, localB;
        toLocal(m_a, m_b, v, localA, localB);
        return evaluate<kIsScaled>(v, length2, limit2, find(localA, localB));
    }

    /// The directions of a pair's supports for an axis, in the axes of the hulls.
    [[gnu::always_inline]] static void toLocal(const PosedHull<S>& a, const PosedHull<S>& b,
                                               const Point& axis, Vector& localA, Vector& localB)
    {
        localB = b.row(0) * axis[0] + b.row(1) * axis[1] + b.row(2) * axis[2];
        localA = -(a.row(0) * axis[0] + a.row(1) * axis[1] + a.row(2) * axis[2]);
    }

    /// False for a NaN, too. An axis of scaledAxis() is not longer than the root of 3.
    template <bool kIsScaled>
    static bool isInRange(S length2)
    {
        return kIsScaled ? length2 > S(1e-16) && length2 < S(3.001) : isTestable(length2);
    }

    /// Evaluates the support vertices along an axis v.
    template <bool kIsScaled>
    [[gnu::always_inline]] AxisTest<S> evaluate(const Point& v, S length2, S limit2, const Hits& hits) const
    {
        // Negative where they separate, so that no sign has to be changed before the comparison.
        const S against =
            (hits.a.height + hits.b.height) + (v[0] * m_offset[0] + v[1] * m_offset[1] + v[2] * m_offset[2]);
        const S upper = against + boundOfLength<kIsScaled>(v) * (std::numeric_limits<S>::epsilon() * m_reach);
        AxisTest<S> test;
        test.isProved = upper < S(0) && upper * upper > limit2 * length2;
        test.along = -against;
        test.vertexA = hits.a.vertex;
        test.vertexB = hits.b.vertex;
        return test;
    }

    /// The support height; the vertex stays unknown for a hull of few vertices.
    [[gnu::always_inline]] static SupportHit<S> height(const PosedHull<S>& shape, const Vector& d,
                                                       std::int32_t start)
    {
        if (shape.hasFewVertices())
            return {-1, largestProduct(shape.hull(), LaneDirection<S>(d))};
        SupportHit<S> hit = {start, S(0)};
        if (isSupport(shape, d, hit))
            return hit;
        // A copy here keeps the direction in registers until then.
        const Vector direction = d;
        return heightNearVertex(shape, direction, hit.vertex);
    }

    /// Not inlined, since a loop would keep the direction in memory.
    ///
    /// @param vertex see hitNearVertex()
    [[gnu::noinline]] static SupportHit<S> heightNearVertex(const PosedHull<S>& shape, const Vector& d,
                                                            std::int32_t vertex)
    {
        if (shape.method() == SupportMethod::Automatic)
            return hitNearVertex(shape.hull(), d, shape.tieBand(), vertex);
        return search(shape, {d[0], d[1], d[2]}, vertex);
    }

    [[gnu::always_inline]] Hits wideHeights([[maybe_unused]] const Vector& dA,
                                            [[maybe_unused]] const Vector& dB) const
    {
        Hits hits = {{-1, S(0)}, {-1, S(0)}};
#ifdef __SSE2__
        if constexpr (std::is_same_v<S, float>)
        {
            float largest[2];
            largestProductsAvx2(m_a.hull(), reinterpret_cast<__m128>(dA), m_b.hull(),
                                reinterpret_cast<__m128>(dB), largest);
            hits.a.height = largest[0];
            hits.b.height = largest[1];
        }
#endif
        return hits;
    }

    static bool hasStart(const PosedHull<S>& shape, std::int32_t start)
    {
        // A negative id is a large unsigned number.
        return static_cast<std::uint32_t>(start) < static_cast<std::uint32_t>(shape.startCount());
    }

    /// Whether a vertex that is likely near the support is the support.
    ///
    /// @param hit [in, out] the vertex, or -1; then with its height, or the vertex to search from
    [[gnu::always_inline]] static bool isSupport(const PosedHull<S>& shape, const Vector& d,
                                                 SupportHit<S>& hit)
    {
        if (!hasStart(shape, hit.vertex))
            return false;
        std::int32_t beside;
        if (isPeak(shape.hull(), hit.vertex, LaneDirection<S>(d), shape.tieBand(), hit.height, beside))
            return true;
        hit.vertex = beside;
        return false;
    }

    [[gnu::always_inline]] static SupportHit<S> support(const PosedHull<S>& shape, const Vector& d,
                                                        std::int32_t start)
    {
        SupportHit<S> hit = {start, S(0)};
        return isSupport(shape, d, hit) ? hit : search(shape, {d[0], d[1], d[2]}, hit.vertex);
    }

    /// Whether a search begins in the start table, since the hull has too many vertices for a scan.
    static bool isMapped(const PosedHull<S>& shape)
    {
        return shape.method() == SupportMethod::Automatic && shape.hull().hasNeighbours() &&
               shape.vertexCount() > linearSupportMaximum<S>();
    }

    /// Interleaves the climbs of both hulls.
    static Hits climbFromMaps(const Hull<S>& a, const Point& dA, const Hull<S>& b, const Point& dB)
    {
        const VertexPair found = climbBoth(a, dA, b, dB, {cubeMapStart(a, dA), cubeMapStart(b, dB)});
        return {{found.a, supportProduct(a, found.a, dA)}, {found.b, supportProduct(b, found.b, dB)}};
    }

    [[gnu::always_inline]] static Hits searchBoth(const PosedHull<S>& a, const Vector& dA,
                                                  const PosedHull<S>& b, const Vector& dB)
    {
        if (a.hasFewVertices() && b.hasFewVertices())
            return {hitFew(a.hull(), LaneDirection<S>(dA)), hitFew(b.hull(), LaneDirection<S>(dB))};
        if (isMapped(a) && isMapped(b))
            return climbFromMaps(a.hull(), {dA[0], dA[1], dA[2]}, b.hull(), {dB[0], dB[1], dB[2]});
        return {search(a, {dA[0], dA[1], dA[2]}, -1), search(b, {dB[0], dB[1], dB[2]}, -1)};
    }

    /// @param start a vertex near the support, or an invalid id
    [[gnu::noinline]] static SupportHit<S> search(const PosedHull<S>& shape,
                                                  const Eigen::Matrix<S, 3, 1>& direction, std::int32_t start)
    {
        const Hull<S>& hull = shape.hull();
        const bool isScanned = hull.vertexCount() <=
                               (hasStart(shape, start) ? cheapScanMaximum<S>() : linearSupportMaximum<S>());
        if (shape.method() == SupportMethod::Automatic && isScanned)
            return hitLinear(hull, direction);
        return supportHit(hull, direction, start, shape.method());
    }

    const PosedHull<S>& m_a;
    const PosedHull<S>& m_b;
    Vector m_offset;
    S m_reach;
};
}  // namespace cullet
