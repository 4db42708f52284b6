// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/lanes.h"
#include "narrow/posed_hull.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace cullet
{
/// The support of A - B against an axis v, in the scalar of the hulls.
template <class S>
struct AxisTest
{
    bool isProved = false;  ///< the shapes are farther apart along v than asked
    S along = S(0);         ///< v.w for the support point w, rounded
    std::int32_t vertexA = -1;
    std::int32_t vertexB = -1;
};

/// The same direction with largest component 1 in magnitude, as HullPair::test() wants it.
template <class S>
inline Eigen::Matrix<S, 3, 1> scaledAxis(const Eigen::Matrix<S, 3, 1>& direction)
{
    const S scale = S(1) / std::max({std::abs(direction[0]), std::abs(direction[1]), std::abs(direction[2])});
    const auto scaled = [&](S value) { return std::min(std::max(value * scale, S(-1)), S(1)); };
    return {scaled(direction[0]), scaled(direction[1]), scaled(direction[2])};
}

/// A square of a distance for HullPair::test(): the exact one unless that would underflow, then more. Where more is not
/// proved, the search in double has the answer.
///
/// In float, 1e-18 times a smaller distance is more than its square by far more than it can lose by underflow, down to
/// distances of 1.5e-23. For those below, it is more than enough that a square is not 0: the length is at least 2.6e-23,
/// divided by an axis of at most the root of 3. Likewise in double.
template <class S>
inline S squareOfLimit(S limit)
{
    constexpr S kLeast = sizeof(S) == sizeof(float) ? S(1e-18) : S(1e-153);
    return limit * std::max(limit, kLeast);
}

/// Two posed hulls, for tests that are done in their own scalar with a bound of the rounding errors instead of points in
/// double. What cannot be proved so is left to the search in double.
///
/// With u the unit of rounding, R the radius of a hull and F the Frobenius norm of its basis, a local direction is off
/// by 3 u of the products of magnitudes that it sums up, and so is a height. By Cauchy and Schwarz the height is off by
/// 6 u F R |v| together, the product with the offset by 4 u |v| times the offset, and adding up by 3 u of all. 10 u |v| times
/// reach() covers it; u is eps / 2, and |v| <= sqrt(3). A coordinate of a point of A - B is off by 5 u reach().
template <class S>
class HullPair
{
public:
    using Vector = typename Quad<S>::Vector;

    // Out of line it costs a tenth of a query.
    [[gnu::always_inline]] HullPair(const PosedHull<S>& a, const PosedHull<S>& b)
        : m_a(a), m_b(b), m_offset(b.originQuad() - a.originQuad())
    {
        setNorms();
        Vector distances = m_offset;
        Quad<S>::makePositive(distances);
        m_reach = m_normA * a.hull().reach() + m_normB * b.hull().reach() + Quad<S>::sumOfThree(distances);
    }

    const PosedHull<S>& a() const { return m_a; }
    const PosedHull<S>& b() const { return m_b; }
    const Vector& offset() const { return m_offset; }
    /// Bounds every coordinate of A - B, and what it is made of.
    S reach() const { return m_reach; }
    /// How far a point of A - B can be from the difference of the origins, for bases that only turn.
    S size() const { return S(0.5774) * (m_normA * m_a.hull().reach() + m_normB * m_b.hull().reach()); }

    /// The point of A - B of two vertices, rounded.
    [[gnu::always_inline]] Eigen::Matrix<S, 3, 1> point(std::int32_t vertexA, std::int32_t vertexB) const
    {
        return place(m_a, vertexA) - place(m_b, vertexB) -
               Eigen::Matrix<S, 3, 1>(m_offset[0], m_offset[1], m_offset[2]);
    }

    /// Is the distance along an axis larger than the root of limit2? Two supports are all that a pair costs that is as
    /// far apart as before.
    ///
    /// @param limit2 a squareOfLimit()
    /// @param vx x, with vy and vz the axis in world axes, from B to A; not tested if longer than the root of 3, or tiny
    AxisTest<S> test(S vx, S vy, S vz, S limit2, std::int32_t startA, std::int32_t startB) const
    {
        return testHere(vx, vy, vz, limit2, startA, startB);
    }

    /// The same, for the one test that most queries end with: then nothing of the pair has to be in memory.
    [[gnu::always_inline]] AxisTest<S> testHere(S vx, S vy, S vz, S limit2, std::int32_t startA,
                                                std::int32_t startB) const
    {
        AxisTest<S> test;
        const S length2 = vx * vx + vy * vy + vz * vz;
        // A NaN makes the comparisons false. No axis of scaledAxis() is longer.
        if (!(length2 > S(1e-16) && length2 < S(3.001)))
            return test;
        const Vector localB = m_b.row(0) * vx + m_b.row(1) * vy + m_b.row(2) * vz;
        const Vector localA = -(m_a.row(0) * vx + m_a.row(1) * vy + m_a.row(2) * vz);
        const SupportHit<S> hitA = support(m_a, localA, m_normA, startA);
        const SupportHit<S> hitB = support(m_b, localB, m_normB, startB);
        test.vertexA = hitA.vertex;
        test.vertexB = hitB.vertex;
        test.along = -(hitA.height + hitB.height) - (vx * m_offset[0] + vy * m_offset[1] + vz * m_offset[2]);
        const S sure = test.along - S(8.7) * std::numeric_limits<S>::epsilon() * m_reach;
        test.isProved = sure > S(0) && sure * sure > limit2 * length2;
        return test;
    }

private:
    [[gnu::always_inline]] static Eigen::Matrix<S, 3, 1> place(const PosedHull<S>& shape, std::int32_t vertex)
    {
        const Eigen::Matrix<S, 3, 1> p = shape.hull().vertex(vertex);
        return {shape.row(0)[0] * p[0] + shape.row(0)[1] * p[1] + shape.row(0)[2] * p[2],
                shape.row(1)[0] * p[0] + shape.row(1)[1] * p[1] + shape.row(1)[2] * p[2],
                shape.row(2)[0] * p[0] + shape.row(2)[1] * p[1] + shape.row(2)[2] * p[2]};
    }

    [[gnu::always_inline]] static void sumSquares(const PosedHull<S>& shape, Vector& sums)
    {
        sums = shape.row(0) * shape.row(0) + shape.row(1) * shape.row(1) + shape.row(2) * shape.row(2);
    }

    /// Both at once.
    [[gnu::always_inline]] void setNorms()
    {
        Vector sumsA, sumsB;
        sumSquares(m_a, sumsA);
        sumSquares(m_b, sumsB);
        const Vector firstTwo = __builtin_shufflevector(sumsA, sumsB, 0, 4, 1, 5);
        Vector norms = firstTwo + __builtin_shufflevector(firstTwo, firstTwo, 2, 3, 2, 3) +
                       __builtin_shufflevector(sumsA, sumsB, 2, 6, 3, 7);
        Quad<S>::takeRootsOfTwo(norms);
        m_normA = norms[0];
        m_normB = norms[1];
    }

    /// @param norm of the basis
    [[gnu::always_inline]] static SupportHit<S> support(const PosedHull<S>& shape, const Vector& d, S norm,
                                                        std::int32_t start)
    {
        const Hull<S>& hull = shape.hull();
        // A negative one is large.
        const bool hasStart =
            static_cast<std::uint32_t>(start) < static_cast<std::uint32_t>(hull.blockCount());
        S height;
        // The 1-norm of the direction is at most sqrt(3) F |v|; the band has room for rounding.
        if (hasStart && shape.method() == SupportMethod::Automatic &&
            isPeak(hull, start, LaneDirection<S>(d), hull.tieBand() * (S(3) * norm), height))
            return {start, height};
        return search(shape, {d[0], d[1], d[2]}, start, hasStart);
    }

    [[gnu::noinline]] static SupportHit<S> search(const PosedHull<S>& shape,
                                                  const Eigen::Matrix<S, 3, 1>& direction, std::int32_t start,
                                                  bool hasStart)
    {
        const Hull<S>& hull = shape.hull();
        const bool isScanned =
            hull.vertexCount() <= (hasStart ? cheapScanMaximum<S>() : linearSupportMaximum<S>());
        if (shape.method() == SupportMethod::Automatic && isScanned)
            return hitLinear(hull, direction);
        return supportHit(hull, direction, start, shape.method());
    }

    const PosedHull<S>& m_a;
    const PosedHull<S>& m_b;
    Vector m_offset;
    S m_normA, m_normB, m_reach;
};
}  // namespace cullet
